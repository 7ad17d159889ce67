"""--config and the environment, and what is said of a variable with a typo."""

import pytest

from tests.run_cli import rollcli

FRAMES = 1


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("lamda0 = 1", "there is no option 'lamda0'; the nearest is 'lambda0'"),
        ("[estimates]\nseed = 1", "there is no command for the table [estimates]"),
        ("[estimate]\nroll = 1", "there is no option 'roll'"),
        ("[derotate]\n[derotate.more]\nroll = 1", "there is no command for the table [derotate.more]"),
        ("seed = 1.5", "'seed': 1.5 is not a whole number"),
        ("seed = -1", "'seed': -1 is not a whole number of at least 0"),
        ("seed = true", "'seed': True is not a whole number"),
        ("invalid = [true]", "'invalid': True is not a number"),
        ('method = "best"', "'method': 'best' is not one of"),
        ("method = 3", "'method' is a text in quotes, not 3"),
        ('timing = "yes"', "'timing' is true or false, not 'yes'"),
        ("roi = [5, 5, 5, 9]", "'roi': [5, 5, 5, 9] is not X0,Y0,X1,Y1"),
        ("seed = ", "is not TOML"),
        ('config = "other.toml"', "there is no option 'config'"),
        # made to harm
        ("a = " + "[" * 100_000, "is not TOML: maximum recursion depth exceeded"),
        ("seed = " + "1" * 5000, "is not TOML: Exceeds the limit"),
        (".".join(["a"] * 50_000) + " = 1", "is no file of options: it has a key of more than 8 parts"),
        ("[" + ".".join(['"a"'] * 50_000) + "]", "is no file of options: it has a key of more than 8 parts"),
        ('output = "a\\u0000b"', "'output' is a text in quotes"),
    ],
)
def test_what_is_wrong_with_a_config_file_is_said_with_its_name(maps, text, reason):
    (maps / "rollcli.toml").write_text(text)
    refusal = rollcli("estimate", "maps", "--config", "rollcli.toml", cwd=maps).refused()
    assert refusal.startswith("rollcli: rollcli.toml: ")
    assert reason in refusal
