"""Geometry of surfaces, tetrahedra and paths: distances, intersections, meshing, attachments, embedding, fibres and extension."""
