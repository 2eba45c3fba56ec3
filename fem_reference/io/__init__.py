"""Reading and writing of meshes and texts. Files are written completely or not at all."""
