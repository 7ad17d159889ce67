"""Sessions at a prompt go as they are written down; see `tests.sessions`."""

from tests import sessions


@sessions.parametrize("cli")
def test_a_session_goes_as_it_is_written_down(tmp_path, heading):
    sessions.check("cli", heading, tmp_path)
