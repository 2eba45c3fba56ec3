"""The door to files: meshes read and written, texts written whole or not at all."""
