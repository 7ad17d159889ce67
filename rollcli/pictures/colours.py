"""The colours of pages and charts, in light and dark mode."""

from collections.abc import Mapping

# by name: as hexadecimal digits of red, green, blue and, where not whole, opacity
Colours = Mapping[str, str]

LIGHT: Colours = {
    "page": "f6f7f9",
    "card": "ffffff",
    "text": "1c2430",
    "muted": "5d6878",
    "line": "dde2e9",
    "grid": "e8ecf1",
    "c1": "2563c9",
    "c2": "d9730d",
    "c3": "12856b",
    "c4": "8a4fc7",
    "c5": "c43a5b",
    "c6": "6b7684",
    "ok": "12856b",
    "suspect": "d9730d",
    "suspect-text": "a85400",
    "error": "c43a5b",
    "band": "2563c929",
}
DARK: Colours = {
    "page": "12161c",
    "card": "1a2029",
    "text": "e4e9f0",
    "muted": "98a4b5",
    "line": "2c3542",
    "grid": "28313d",
    "c1": "6ea3f7",
    "c2": "f0a152",
    "c3": "4cc3a2",
    "c4": "bd93ee",
    "c5": "ee7d98",
    "c6": "9aa6b5",
    "ok": "4cc3a2",
    "suspect": "f0a152",
    "suspect-text": "f0a152",
    "error": "ee7d98",
    "band": "6ea3f733",
}


def style_sheet() -> str:
    """Return the colours as custom properties of a page, which follow light and dark mode."""
    dark = f"@media screen and (prefers-color-scheme: dark) {{ :root {{ {_properties(DARK)} }} }}"
    return f":root {{ {_properties(LIGHT)} }}\n{dark}\n"


def _properties(colours: Colours) -> str:
    return " ".join(f"--{name}: #{digits};" for name, digits in colours.items())
