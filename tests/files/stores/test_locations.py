"""Names of places and of parts, and what a store objects to: its error codes become one line."""

import pytest

from rollcli.files.results import part_names
from rollcli.files.stores.objects import holds_for_all, is_final, reason_of, what_is_missing
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


NO_BUCKET = "there is no such bucket"
DENIED = "access is denied; check the rights of these keys"
REGION = "the bucket is in another region; set AWS_REGION"


def answer(status, code=""):
    """An error as obstore words it."""
    body = f": <Error><Code>{code}</Code><Message>x</Message></Error>" if code else ""
    return Exception(f"Generic S3 error: Server returned non-2xx status code: {status}{body}")


NAMED = (
    "Generic S3 error: Error performing GET http://127.0.0.1:9/maps/{0}/a%20b.png in 11 ms - Server returned "
    "non-2xx status code: {1}: <Error><Code>X</Code><Resource>/maps/{0}/a b.png</Resource><Key>{0}</Key>"
    "</Error>"
    "\n\nDebug source:\nGeneric {{ uri: Some(\n http://127.0.0.1:9/maps/{0}/a%20b.png,\n) }}"
)


@pytest.mark.parametrize(
    "name",
    ["metadata", "redirects", "MissingAccount", "169.254.169.254", "NoSuchBucket", "301 Moved Permanently"],
)
def test_names_of_objects_say_nothing_of_what_is_wrong(name):
    passing = Exception(NAMED.format(name, "503 Service Unavailable"))
    assert reason_of(passing) == "the store answered 503"
    assert not is_final(passing)
    assert what_is_missing(Exception(NAMED.format(name, "404 Not Found"))) == "there is no such object"


NO_ANSWER = "the store does not answer; check the network and the endpoint"
SLOW = "the store takes too long; ROLLCLI_STORE_TIMEOUT sets the seconds it may take"
NO_KEYS = "no keys are given; set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or the store's own"
SENDING = "HTTP error: error sending request"
# status and code of an answer, what is said, whether it holds for all objects, and whether for good;
# the codes are those of the lists of errors of Amazon S3 and of Azure Blob Storage
ANSWERS = [
    ("404 Not Found", "NoSuchBucket", NO_BUCKET, True, True),
    ("404 Not Found", "ContainerNotFound", NO_BUCKET, True, True),
    ("403 Forbidden", "AccessDenied", DENIED, False, True),
    ("403 Forbidden", "", DENIED, False, True),
    ("401 Unauthorized", "", "the keys are not accepted; check them", True, True),
    ("403 Forbidden", "InvalidAccessKeyId", "the access key is unknown; check AWS_ACCESS_KEY_ID", True, True),
    (
        *("403 Forbidden", "SignatureDoesNotMatch"),
        *("the secret key is wrong; check AWS_SECRET_ACCESS_KEY", True, True),
    ),
    ("400 Bad Request", "ExpiredToken", "the keys have expired; fetch new ones", True, True),
    (
        *("403 Forbidden", "RequestTimeTooSkewed"),
        *("this machine's clock differs from the store's; set it", True, True),
    ),
    ("301 Moved Permanently", "PermanentRedirect", REGION, True, True),
    ("400 Bad Request", "AuthorizationHeaderMalformed", REGION, True, True),
    ("400 Bad Request", "RequestTimeout", "the store answered 400", False, False),
    *(
        (f"{code} x", "", f"the store answered {code}", False, code == 418)
        for code in (408, 429, 500, 503, 418)
    ),
]
ERRORS = [
    ("Received redirect without LOCATION", REGION, True, True),
    ("Error performing PUT http://169.254.169.254/latest/api/token", NO_KEYS, True, True),
    (
        "Generic MicrosoftAzure error: MissingAccount",
        *("no account is given; set AZURE_STORAGE_ACCOUNT_NAME", True, False),
    ),
    (f"{SENDING} (kind: Timeout)", SLOW, True, False),
    *(
        (text, NO_ANSWER, True, False)
        for text in (SENDING, "Connection refused", "reading a body from connection")
    ),
    ("error decoding response body", "the answer of the store was cut short", False, False),
    ("something else", "the store refused the request", False, False),
]


@pytest.mark.parametrize(
    ("error", "said", "of_all", "final"),
    [(answer(*each[:2]), *each[2:]) for each in ANSWERS]
    + [(Exception(each[0]), *each[1:]) for each in ERRORS],
    ids=lambda each: str(each)[:60] if isinstance(each, Exception) else None,
)
def test_an_objection_is_said_and_weighed(error, said, of_all, final):
    assert reason_of(error) == said
    assert holds_for_all(said) == of_all
    assert is_final(error) == final


def test_a_bucket_that_is_missing_is_told_from_an_object():
    for code in ("NoSuchBucket", "ContainerNotFound"):
        assert what_is_missing(answer("404 Not Found", code)) == NO_BUCKET
    for code in ("NoSuchKey", "BlobNotFound"):
        assert what_is_missing(answer("404 Not Found", code)) == "there is no such object"
    assert not holds_for_all("there is no such object")
