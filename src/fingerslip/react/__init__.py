"""How long there is to react: something notices slip, after a latency the grip rises, the object is saved or lost."""
