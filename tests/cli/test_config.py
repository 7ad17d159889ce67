"""Files of options that were made to harm."""

import pytest

from tests.run_cli import rollcli

FRAMES = 1


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("a = " + "[" * 100_000, "is not TOML: maximum recursion depth exceeded"),
        ("seed = " + "1" * 5000, "is not TOML: Exceeds the limit"),
        (".".join(["a"] * 50_000) + " = 1", "is no file of options: it has a key of more than 8 parts"),
        ("[" + ".".join(['"a"'] * 50_000) + "]", "is no file of options: it has a key of more than 8 parts"),
    ],
)
def test_a_file_of_options_that_was_made_to_harm_is_refused_by_its_name(maps, text, reason):
    (maps / "rollcli.toml").write_text(text)
    refusal = rollcli("estimate", "maps", "--config", "rollcli.toml", cwd=maps).refused()
    assert refusal.startswith("rollcli: rollcli.toml: ")
    assert reason in refusal
