"""What layers are made of: a file for each law, with its parameters, and how layers damp."""
