"""What is pure geometry: distances, intersections, tetrahedra, attachments, embedding, fibres, extension."""
