"""The colours of pages and charts, in light and dark mode."""

from collections.abc import Mapping

Colours = Mapping[str, tuple[str, float]]  # by name: as hexadecimal digits of red, green, blue; opacity

LIGHT: Colours = {
    "page": ("f6f7f9", 1),
    "card": ("ffffff", 1),
    "text": ("1c2430", 1),
    "muted": ("5d6878", 1),
    "line": ("dde2e9", 1),
    "grid": ("e8ecf1", 1),
    "c1": ("2563c9", 1),
    "c2": ("d9730d", 1),
    "c3": ("12856b", 1),
    "c4": ("8a4fc7", 1),
    "c5": ("c43a5b", 1),
    "c6": ("6b7684", 1),
    "ok": ("12856b", 1),
    "suspect": ("d9730d", 1),
    "suspect-text": ("a85400", 1),
    "error": ("c43a5b", 1),
    "band": ("2563c9", 0.16),
}
DARK: Colours = {
    "page": ("12161c", 1),
    "card": ("1a2029", 1),
    "text": ("e4e9f0", 1),
    "muted": ("98a4b5", 1),
    "line": ("2c3542", 1),
    "grid": ("28313d", 1),
    "c1": ("6ea3f7", 1),
    "c2": ("f0a152", 1),
    "c3": ("4cc3a2", 1),
    "c4": ("bd93ee", 1),
    "c5": ("ee7d98", 1),
    "c6": ("9aa6b5", 1),
    "ok": ("4cc3a2", 1),
    "suspect": ("f0a152", 1),
    "suspect-text": ("f0a152", 1),
    "error": ("ee7d98", 1),
    "band": ("6ea3f7", 0.2),
}


def rgb(name: str, colours: Colours = LIGHT) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255."""
    red, green, blue = bytes.fromhex(colours[name][0])
    return red, green, blue


def style_sheet() -> str:
    """Return the colours as custom properties of a page, which follow light and dark mode."""
    dark = f"@media screen and (prefers-color-scheme: dark) {{ :root {{ {_properties(DARK)} }} }}"
    return f":root {{ {_properties(LIGHT)} }}\n{dark}\n"


def _properties(colours: Colours) -> str:
    values = {name: (*rgb(name, colours), opacity) for name, (_, opacity) in colours.items()}
    return " ".join(f"--{name}: rgba{value};" for name, value in values.items())
