"""Files: written whole or not at all, with checksums; datasets as netCDF-4."""
