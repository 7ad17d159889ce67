"""Names of places and of parts."""

from rollcli.files.results import part_names
from tests.object_store import upload
from tests.run_cli import rollcli, write_maps


def test_parts_have_numbers_and_come_in_their_order():
    names = ["part-00010.csv", "part-00009.csv", "part-100000.csv", "part-00000.csv"]
    others = ["part-0001.csv", "part-00001.txt", "xpart-00001.csv", "part-00001.csv.gz", "part-00001"]
    assert part_names(names + others) == [
        "part-00000.csv",
        "part-00009.csv",
        "part-00010.csv",
        "part-100000.csv",
    ]
    for ending in ("jsonl", "parquet"):
        assert part_names([f"part-00000.{ending}"]) == [f"part-00000.{ending}"]


def test_a_prefix_with_a_dot_is_a_folder_where_objects_lie_below_it(tmp_path, bucket, store):
    write_maps(tmp_path / "maps", 2)
    upload(tmp_path / "maps", f"{bucket}/2024.05.01")
    folder = rollcli("estimate", f"{bucket}/2024.05.01", cwd=tmp_path, **store)
    file = rollcli("estimate", f"{bucket}/2024.05.02", cwd=tmp_path, **store)
    assert folder.status == 0, folder.err
    assert f"{bucket}/2024.05.01/frame1.png" in folder.out
    assert "there is no such object" in file.out + file.err
