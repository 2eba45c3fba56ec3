"""Pictures inside a page: WebP as the value of the attribute ``src``."""

import base64
import io

from PIL import Image


def webp(picture: Image.Image, quality: int) -> str:
    """A picture as the value of ``src``, compressed with a ``quality`` of at most 100."""
    stored = io.BytesIO()
    picture.save(stored, "WEBP", quality=quality, method=4)
    return picture_source(stored.getvalue())


def picture_source(stored: bytes) -> str:
    """The bytes of a WebP picture as the value of ``src``."""
    return f"data:image/webp;base64,{base64.b64encode(stored).decode()}"
