"""Geometry: distances, intersections, tetrahedra, attachments, embedding, fibres, extension."""
