"""The sensor's eyes: marker tracks, cameras, and fields from markers. Knows nothing of finite elements."""
