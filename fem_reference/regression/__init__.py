"""Is a candidate still what it was, and still as near to the reference as it should be? Asked at every change of its code.

Two questions of every statistic, frame by frame, and one of the candidate's positions:

- ``unchanged``: today's value against that of a stored baseline, within its ``tolerance``. This is the candidate against its own
  past; how well the truth is known does not matter. Positions of a sample of vertices are asked as well: a frame that is moved
  aside may deviate by as much as before, only elsewhere.
- ``within``: the deviation from the reference against the greatest one allowed. It cannot be told where the reference's own error
  bar is more than a third of that, or where nobody knows the bar.

``baseline`` is the file, ``checking`` the two questions, ``told`` the answers as text, JSON, Markdown and JUnit XML.
"""
