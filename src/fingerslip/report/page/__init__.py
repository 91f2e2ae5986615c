"""The report page of a study, and what it is assembled from."""
