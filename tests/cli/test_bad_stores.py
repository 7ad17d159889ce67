"""What is wrong with a store, its keys or an address is one line before any work, and shows no secret."""

import json

import pytest

from tests.object_store import upload
from tests.run_cli import contents, road_map, rollcli, write_kitti, write_maps
from tests.store_proxy import PASS, answer, proxied
from tests.web_server import file_below, response, web_server

SECRET = "c0ffee5ec2e7"
SIGNED = f"?X-Amz-Credential={SECRET}&X-Amz-Signature={SECRET}"


@pytest.fixture
def bucket(bucket, tmp_path):
    """Two maps on disk and in the bucket."""
    write_maps(tmp_path / "maps", 2)
    upload(tmp_path / "maps", f"{bucket}/maps")
    return bucket


ANSWERS = {
    "no rights": (answer("403 Forbidden", "AccessDenied"), "access is denied; check the rights"),
    "another region": (answer("301 Moved Permanently", "PermanentRedirect"), "set AWS_REGION"),
    "a malformed region": (answer("400 Bad Request", "AuthorizationHeaderMalformed"), "set AWS_REGION"),
    "expired keys": (answer("400 Bad Request", "ExpiredToken"), "the keys have expired; fetch new ones"),
    "an unknown key": (answer("403 Forbidden", "InvalidAccessKeyId"), "check AWS_ACCESS_KEY_ID"),
    "a wrong key": (answer("403 Forbidden", "SignatureDoesNotMatch"), "check AWS_SECRET_ACCESS_KEY"),
}
PLACES = {
    "a folder in": ["estimate", "@/maps/"],
    "a file in": ["estimate", "@/maps/frame0.png", "-o", "rolls.csv"],
    "a result out": ["estimate", "maps", "-o", "@/rolls.csv"],
}
VIEWS = ["--left", "maps/frame0.png", "--right", "maps/frame1.png", "--overwrite"]


def refusal(folder, *words, **variables):
    """The one line of a usage error, which shows no secret; nothing was written."""
    before = contents(folder)
    said = rollcli(*words, cwd=folder, **variables).refused()
    assert SECRET not in said
    assert contents(folder) == before
    return said


@pytest.mark.parametrize(
    ("what", "place"),
    [
        *((what, "a file in") for what in ANSWERS),
        ("another region", "a folder in"),
        ("no rights", "a folder in"),
        ("expired keys", "a result out"),
    ],
)
def test_what_a_store_objects_to_is_said_before_any_work(bucket, store, tmp_path, what, place):
    reply, said = ANSWERS[what]
    words = [word.replace("@", bucket) for word in PLACES[place]]
    with proxied(store["AWS_ENDPOINT_URL"], lambda *_: reply) as address:
        variables = {"AWS_ENDPOINT_URL": address, "AWS_SECRET_ACCESS_KEY": SECRET}
        assert said in refusal(tmp_path, *words, **variables)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["estimate", "s3://nowhere/a.png"], "there is no such bucket"),
        (["estimate", "s3://nowhere/maps/"], "nowhere/maps/: cannot be listed: there is no such bucket"),
        (["estimate", "s3://maps/empty/"], "no input found in this folder"),
        (["estimate", "maps", "-o", "s3://nowhere/rolls.csv"], "there is no such bucket"),
        (["estimate", "maps", "--derotated", "s3://nowhere/up", "--overwrite"], "there is no such bucket"),
        (["derotate", "maps", "--roll", "1", "-o", "s3://nowhere/up"], "there is no such bucket"),
        (["disparity", *VIEWS, "-o", "d", "--preview", "s3://nowhere/p"], "there is no such bucket"),
        (["rig", "s3://maps/none.csv"], "there is no such object"),
        (["estimate", *VIEWS, "--align", "s3://maps/none.json"], "there is no such object"),
        (["estimate", *VIEWS, "--mask", "s3://maps/none.png"], "there is no such object"),
        (["evaluate", "paper", "maps", "-o", "s3://nowhere/p"], "there is no such bucket"),
    ],
)
def test_a_wrong_address_is_one_line_before_any_work(bucket, tmp_path, words, said):
    assert said in refusal(tmp_path, *words)


def test_an_endpoint_without_its_scheme_is_no_address(bucket, tmp_path):
    said = "AWS_ENDPOINT_URL: is no address; write it as https://host, or http://host:9000"
    assert said in refusal(tmp_path, "estimate", "s3://maps/a.png", AWS_ENDPOINT_URL="localhost:9000")


def test_an_object_that_may_not_be_read_costs_its_row_alone(bucket, store, tmp_path):
    def treat(method, target):
        denied = "frame1.png" in target and method == "GET"
        return answer("403 Forbidden", "AccessDenied") if denied else PASS

    with proxied(store["AWS_ENDPOINT_URL"], treat) as address:
        done = rollcli("estimate", f"{bucket}/maps/", cwd=tmp_path, AWS_ENDPOINT_URL=address, status=3)
    assert [line.split(",")[2] for line in done.out.splitlines()[1:]] == ["ok", "error"]
    assert "access is denied" in done.out


@pytest.fixture
def web(tmp_path):
    """The address of a web server over a folder; what is called `expired` it refuses, as a store does."""
    (tmp_path / "web").mkdir()

    def answer(asked):
        return response(403) if "expired" in asked else file_below(tmp_path / "web", asked)

    with web_server(answer) as (address, _):
        yield address


def test_a_signed_address_works_and_is_shown_nowhere(web, tmp_path):
    write_kitti(tmp_path / "web" / "map 1.png", road_map(0.1))
    write_kitti(tmp_path / "web" / "mask.png", road_map())
    (tmp_path / "web" / "broken.png").write_bytes(b"no map")
    maps = [f"{web}/{name}.png{SIGNED}" for name in ("map%201", "broken", "none")]
    line = ("estimate", *maps, "--mask", f"{web}/mask.png{SIGNED}", "-o", "rolls.csv", "--derotated=up", "-v")
    listed = rollcli(*line, "--dry-run", cwd=tmp_path)
    done = rollcli(*line, cwd=tmp_path, status=3)
    assert (tmp_path / "rolls.csv").read_text().count(",error,") == 2
    (tmp_path / "web" / "rolls.csv").write_bytes((tmp_path / "rolls.csv").read_bytes())
    shown = rollcli("rig", f"{web}/rolls.csv{SIGNED}", cwd=tmp_path, status=0)
    nothing = rollcli("rig", f"{web}/none.csv{SIGNED}", cwd=tmp_path)
    assert "the server answered 404" in nothing.err
    said = [each for ended in (listed, done, shown, nothing) for each in (ended.out, ended.err)]
    written = [name + data.decode("latin-1") for name, data in contents(tmp_path).items()]
    assert SECRET not in "".join([*said, *written])
    assert f"read  {web}/broken.png\n" in listed.out
    assert json.loads((tmp_path / "rolls.csv.run.json").read_bytes())["options"]["mask"] == f"{web}/mask.png"
