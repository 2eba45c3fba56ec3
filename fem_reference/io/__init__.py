"""Reading and writing of files: meshes and texts, written whole or not at all."""
