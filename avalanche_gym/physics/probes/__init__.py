"""Questions to the geometry of a world that change nothing: rays and nearest points, one file a family of shapes."""
