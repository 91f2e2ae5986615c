"""Meshes with named regions and boundaries: built from a specimen or a scan, read and written; their quality."""
