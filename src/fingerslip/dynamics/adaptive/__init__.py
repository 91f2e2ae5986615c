"""Steps that control their own error: where they must end, and how long they are."""
