"""Sessions at a prompt go as they are written down; see `tests.sessions`."""

from tests import sessions


@sessions.parametrize("run")
def test_a_session_goes_as_it_is_written_down(tmp_path, heading):
    sessions.check("run", heading, tmp_path)
