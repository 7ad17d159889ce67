"""--config and the environment, and what is said of a variable with a typo."""

import json

import cv2
import pytest

from tests.run_cli import rollcli

FRAMES = 1


def options_of(folder, *arguments, **variables):
    """The effective options of a run, from its record."""
    done = rollcli("estimate", "maps", "-o", "rolls.csv", "--overwrite", *arguments, cwd=folder, **variables)
    assert done.status == 0, done.err
    return json.loads((folder / "rolls.csv.run.json").read_text())["options"]


def test_a_config_file_sets_options_of_every_kind(maps):
    (maps / "rollcli.toml").write_text(
        'method = "exact"\nmax-roll = 30\ntolerance = 0.01\nlambda0 = "auto"\nroi = [0, 0, 100, 100]\n'
        'invalid = [1, 2.5]\npolygon = "0,0 150,0 150,110"\ntiming = true\nsave_as = "npy"\nseed = 3\n'
    )
    expected = {"method": "exact", "max-roll": 30, "lambda0": "auto", "roi": [0, 0, 100, 100]}
    expected |= {"invalid": [1, 2.5], "polygon": [[0, 0], [150, 0], [150, 110]]}
    expected |= {"timing": True, "save-as": "npy", "seed": 3}
    options = options_of(maps, "--config", "rollcli.toml")
    assert {name: options[name] for name in expected} == expected


def test_flags_win_over_the_environment_and_the_environment_over_the_config(maps):
    (maps / "rollcli.toml").write_text("seed = 1\nmax-roll = 11\ntolerance = 0.1\n")
    environment = {"ROLLCLI_ESTIMATE_MAX_ROLL": "22", "ROLLCLI_ESTIMATE_TOLERANCE": "0.2"}
    options = options_of(maps, "--config", "rollcli.toml", "--tolerance", "0.3", **environment)
    assert (options["seed"], options["max-roll"], options["tolerance"]) == (1, 22, 0.3)


def test_one_file_serves_all_commands(maps):
    (maps / "rig.toml").write_text(
        "quiet = true\nexpand = true\n[estimate]\nmethod = 'exact'\n[derotate]\nroll = 2.5\n"
        "[evaluate.accuracy]\nformat = 'csv'\n"
    )
    assert options_of(maps, "--config", "rig.toml")["method"] == "exact"
    turned = rollcli("derotate", "maps", "-o", "level", "--config", "rig.toml", cwd=maps)
    assert (turned.status, turned.err) == (0, "")
    width = cv2.imread(str(maps / "maps" / "frame0.png"), cv2.IMREAD_UNCHANGED).shape[1]
    assert cv2.imread(str(maps / "level" / "frame0.png"), cv2.IMREAD_UNCHANGED).shape[1] > width


def test_the_config_file_itself_may_come_from_the_environment(maps):
    (maps / "rollcli.toml").write_text('road = "all"\n')
    assert options_of(maps, ROLLCLI_ESTIMATE_CONFIG="rollcli.toml")["road"] == "all"


def test_every_kind_of_option_reads_the_environment(maps):
    given = {"ENCODING": "px", "TIMING": "1", "INVALID": "5 6", "ROI": "0,0,90,90"}
    options = options_of(maps, **{f"ROLLCLI_ESTIMATE_{name}": value for name, value in given.items()})
    assert (options["encoding"], options["timing"], options["invalid"]) == ("px", True, [5, 6])
    assert options["roi"] == [0, 0, 90, 90]


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("SEED", "1.5", "'1.5' is not a whole number of at least 0"),
        ("ROAD", "none", "'none' is not one of 'auto', 'all'."),
        ("QUIET", "perhaps", "'perhaps' is not a valid boolean."),
        ("INVALID", "5 x", "'x' is not a number"),
        ("SHARD", "3/2", "'3/2' is not I/N"),
    ],
)
def test_what_is_wrong_with_the_environment_is_said_with_the_name_of_the_variable(maps, name, value, reason):
    refusal = rollcli("estimate", "maps", cwd=maps, **{f"ROLLCLI_ESTIMATE_{name}": value}).refused()
    assert refusal.startswith(f"rollcli: ROLLCLI_ESTIMATE_{name}: {reason}")


def test_resume_and_overwrite_exclude_each_other_unless_one_is_said_nearer(maps):
    (maps / "rollcli.toml").write_text("overwrite = true\n")
    both = ("estimate", "maps", "-o", "rolls.csv", "-v", "--resume")
    kept = "1 frame (1 kept)"
    rollcli("estimate", "maps", "-o", "rolls.csv", cwd=maps)
    assert rollcli(*both, "--overwrite", cwd=maps).status == 2
    assert kept in rollcli(*both, "--config", "rollcli.toml", cwd=maps).err
    assert kept in rollcli(*both, cwd=maps, ROLLCLI_ESTIMATE_OVERWRITE="1").err
    again = ("estimate", "maps", "-o", "rolls.csv", "--overwrite")
    done = rollcli(*again, cwd=maps, ROLLCLI_ESTIMATE_RESUME="1")
    assert (done.status, kept in done.err) == (0, False)


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


def test_lists_of_numbers_and_names_with_dots_are_no_long_keys(maps):
    (maps / "rollcli.toml").write_text(
        'polygon = [[0.5, 0.5],\n[1.5e2, 0.5], [1.5e2,\n 1.1e2]]\nmask = "a.b.c.d.e.f.g.h.i.png"\n'
    )

    done = rollcli("estimate", "maps", "--config", "rollcli.toml", cwd=maps)

    assert "a.b.c.d.e.f.g.h.i.png: no such mask" in done.err


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "ROLLCLI_ESTIMATE_MAX_ROL",
            "there is no such option of rollcli estimate; did you mean ROLLCLI_ESTIMATE_MAX_ROLL?",
        ),
        ("ROLLCLI_ESTIMTE_JOBS", "there is no such command or setting; did you mean ROLLCLI_ESTIMATE_JOBS?"),
        ("ROLLCLI_STORE_TIMOUT", "there is no such command or setting; did you mean ROLLCLI_STORE_TIMEOUT?"),
        ("ROLLCLI_ESTIMATE_XYZZYPLUGH", "there is no such option of rollcli estimate"),
    ],
)
def test_a_variable_with_a_typo_is_said(maps, name, said):
    done = rollcli("estimate", "maps", cwd=maps, **{name: "4"})
    assert done.status == 0
    assert f"rollcli: {name}: {said}\n" in done.err
    assert name not in rollcli("estimate", "maps", "-q", cwd=maps, **{name: "4"}).err


def test_variables_of_this_and_other_commands_are_not_said(maps):
    known = {
        "ROLLCLI_ESTIMATE_MAX_ROLL": "30",
        "ROLLCLI_DEROTATE_ROL": "3",
        "ROLLCLI_EVALUATE_PAPER_TIMED": "2",
        "ROLLCLI_STORE_TIMEOUT": "5",
        "ROLLCLI_RIG_X": "1",
    }
    assert "ROLLCLI_" not in rollcli("estimate", "maps", cwd=maps, **known).err
