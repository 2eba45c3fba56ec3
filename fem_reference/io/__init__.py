"""Reading and writing of files: meshes and texts, written completely or not at all."""
