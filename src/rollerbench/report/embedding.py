"""What a page carries inside, so that it needs no other file: recordings, pictures, figures."""

import base64
import gzip
import re

from markupsafe import Markup

REFERENCE = r'(?:url\(|href=")#([\w-]+)'
"""How a part of a figure names another."""


def packed(page: bytes) -> str:
    """A page as the text that the template's script unpacks: gzip, then base64; the same text for the same page."""
    return base64.b64encode(gzip.compress(page, compresslevel=6, mtime=0)).decode("ascii")


def picture_address(png: bytes) -> str:
    """The address of a PNG that is its own content."""
    return f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"


def inline_svg(svg: str, name: str, label: str) -> Markup:
    """A figure within a page.

    Args:
        svg: Its text, as that of a file.
        name: Unique name on the page: identifiers of one figure must not mean parts of another.
        label: What it shows, for those who cannot see it.
    """
    text = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], count=1, flags=re.DOTALL)
    used = set(re.findall(REFERENCE, text))
    text = re.sub(r' id="([^"]+)"', lambda found: f' id="{name}-{found[1]}"' if found[1] in used else "", text)
    text = re.sub(REFERENCE, lambda found: found[0].replace("#", f"#{name}-"), text)
    return Markup(text.replace("<svg ", Markup('<svg role="img" aria-label="{}" ').format(label), 1))
