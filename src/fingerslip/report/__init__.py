"""Tables, figures and the page of a study; reads results, never solves."""
