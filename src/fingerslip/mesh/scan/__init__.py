"""The mesh of a scanned finger: its surfaces repaired, placed and filled with tetrahedra."""
