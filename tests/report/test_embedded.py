"""Pictures inside a page."""

import base64
import io

from PIL import Image

from fem_reference.report import embedded


def test_a_picture_is_what_stands_in_a_source() -> None:
    source = embedded.webp(Image.new("RGB", (4, 3), "#ff0000"), 80)
    kind, stored = source.split(",")
    assert kind == "data:image/webp;base64"
    assert Image.open(io.BytesIO(base64.b64decode(stored))).size == (4, 3)
