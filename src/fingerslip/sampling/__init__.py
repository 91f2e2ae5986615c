"""What samples of unknown values say: the interval of each slip time, and what each value does to it."""
