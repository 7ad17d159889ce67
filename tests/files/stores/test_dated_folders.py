"""A prefix that ends as a date does is a folder where objects lie below it."""

from tests.object_store import upload
from tests.run_cli import rollcli, write_maps


def test_a_prefix_with_a_dot_is_a_folder_where_objects_lie_below_it(tmp_path, bucket, store):
    write_maps(tmp_path / "maps", 2)
    upload(tmp_path / "maps", f"{bucket}/2024.05.01")
    folder = rollcli("estimate", f"{bucket}/2024.05.01", cwd=tmp_path, **store)
    file = rollcli("estimate", f"{bucket}/2024.05.02", cwd=tmp_path, **store)
    assert folder.status == 0, folder.err
    assert f"{bucket}/2024.05.01/frame1.png" in folder.out
    assert "there is no such object" in file.out + file.err
