"""The frictional contact problem of one step, solved on the contact nodes."""
