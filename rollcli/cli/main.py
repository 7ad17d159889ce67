"""The `rollcli` group: commands are imported when they are called."""

from importlib import import_module

import click

from rollcli import __version__

# name -> (module, one-line help): `rollcli --help` needs no command's module
COMMANDS = {
    "estimate": (
        "rollcli.cli.estimate",
        "The roll of each disparity map or stereo pair, as CSV or JSON Lines.",
    ),
    "disparity": ("rollcli.cli.disparity", "Stereo pairs to disparity maps with OpenCV SGBM."),
    "derotate": ("rollcli.cli.derotate", "Rotate maps by one angle, or by the angles of a result."),
    "vdisparity": ("rollcli.cli.vdisparity", "v-disparity images of maps."),
    "simulate": ("rollcli.cli.simulate", "Render road stereo pairs and true disparity with known roll."),
    "evaluate": ("rollcli.cli.evaluate", "The paper's experiments; accuracy against known angles."),
    "report": ("rollcli.cli.report", "An HTML report of a result."),
}


class LazyGroup(click.Group):
    """A group that imports a command's module when the command is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = getattr(import_module(COMMANDS[cmd_name][0]), cmd_name)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


@click.group(
    cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "auto_envvar_prefix": "ROLLCLI"}
)
@click.version_option(__version__, prog_name="rollcli")
def main() -> None:
    """Estimate the roll angle of a stereo rig from disparity maps or stereo pairs."""
