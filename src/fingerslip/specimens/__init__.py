"""What is pressed on a surface: numbers only."""
