"""The colours of pages and charts, in light and dark mode."""

from collections.abc import Mapping

# by name, in light and in dark mode: as hexadecimal digits of red, green, blue and, where not whole, opacity
_COLOURS = {
    "page": ("f6f7f9", "12161c"),
    "card": ("ffffff", "1a2029"),
    "text": ("1c2430", "e4e9f0"),
    "muted": ("5d6878", "98a4b5"),
    "line": ("dde2e9", "2c3542"),
    "grid": ("e8ecf1", "28313d"),
    "c1": ("2563c9", "6ea3f7"),
    "c2": ("d9730d", "f0a152"),
    "c3": ("12856b", "4cc3a2"),
    "c4": ("8a4fc7", "bd93ee"),
    "c5": ("c43a5b", "ee7d98"),
    "c6": ("6b7684", "9aa6b5"),
    "suspect": ("d9730d", "f0a152"),
    "suspect-text": ("a85400", "f0a152"),
    "error": ("c43a5b", "ee7d98"),
    "band": ("2563c929", "6ea3f733"),
    "mounting": ("12856b29", "4cc3a233"),
}
LIGHT, DARK = ({name: modes[place] for name, modes in _COLOURS.items()} for place in (0, 1))


def style_sheet() -> str:
    """Return the colours as custom properties of a page, which follow light and dark mode."""
    dark = f"@media screen and (prefers-color-scheme: dark) {{ :root {{ {_properties(DARK)} }} }}"
    return f":root {{ {_properties(LIGHT)} }}\n{dark}\n"


def _properties(colours: Mapping[str, str]) -> str:
    return " ".join(f"--{name}: #{digits};" for name, digits in colours.items())
