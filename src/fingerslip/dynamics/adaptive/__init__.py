"""Steps that control their own error: where they must end, what they leave, and the march that chooses them."""
