"""Which run may continue another one: the comparison of their records."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

from rollcli.errors import UsageError


def not_resumable(name: str, reason: str) -> UsageError:
    """Make the error that refuses to continue a result; its one line says what to do."""
    return UsageError(f"{name}: cannot be resumed: {reason}; --overwrite starts anew")


def differences(was: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """Yield what differs between the version and the options of two records, in words."""
    if was["rollcli"] != now["rollcli"]:
        yield f"it was begun by rollcli {was['rollcli']}, this is {now['rollcli']}"
    options_was, options_now = was["options"], json.loads(json.dumps(now["options"]))
    for key in (*options_now, *(key for key in options_was if key not in options_now)):
        if options_was.get(key) != options_now.get(key):
            yield f"--{key} was {_shown(options_was.get(key))}, is now {_shown(options_now.get(key))}"


def _shown(value: Any) -> str:
    return "not given" if value in (None, []) else str(value)
