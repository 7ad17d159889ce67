"""`rollcli evaluate`: the group of its commands."""

import click

from rollcli.cli.evaluate.accuracy import accuracy
from rollcli.cli.evaluate.paper import paper


@click.group(invoke_without_command=True)
@click.pass_context
def evaluate(ctx: click.Context) -> None:
    """Repeat the paper's experiments on your maps; compare results with known angles."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


evaluate.add_command(accuracy)
evaluate.add_command(paper)
