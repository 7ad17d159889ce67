"""What a store objects to: its documented error codes become one line that says what to do."""

import pytest

from rollcli.files.stores.objects import holds_for_all, is_final, reason_of, what_is_missing

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


# the codes are those of the lists of errors of Amazon S3 and of Azure Blob Storage
@pytest.mark.parametrize(
    ("error", "said", "of_all", "final"),
    [
        (answer("404 Not Found", "NoSuchBucket"), NO_BUCKET, True, True),
        (answer("404 Not Found", "ContainerNotFound"), NO_BUCKET, True, True),
        (answer("403 Forbidden", "AccessDenied"), DENIED, False, True),
        (answer("403 Forbidden"), DENIED, False, True),
        (answer("401 Unauthorized"), "the keys are not accepted; check them", True, True),
        (
            answer("403 Forbidden", "InvalidAccessKeyId"),
            "the access key is unknown; check AWS_ACCESS_KEY_ID",
            True,
            True,
        ),
        (
            answer("403 Forbidden", "SignatureDoesNotMatch"),
            "the secret key is wrong; check AWS_SECRET_ACCESS_KEY",
            True,
            True,
        ),
        (answer("400 Bad Request", "ExpiredToken"), "the keys have expired; fetch new ones", True, True),
        (
            answer("403 Forbidden", "RequestTimeTooSkewed"),
            "this machine's clock differs from the store's; set it",
            True,
            True,
        ),
        (answer("301 Moved Permanently", "PermanentRedirect"), REGION, True, True),
        (Exception("Received redirect without LOCATION"), REGION, True, True),
        (answer("400 Bad Request", "AuthorizationHeaderMalformed"), REGION, True, True),
        (answer("400 Bad Request", "RequestTimeout"), "the store answered 400", False, False),
        (answer("408 Request Timeout"), "the store answered 408", False, False),
        (answer("429 Too Many Requests"), "the store answered 429", False, False),
        (answer("500 Internal Server Error"), "the store answered 500", False, False),
        (answer("503 Slow Down"), "the store answered 503", False, False),
        (answer("418 I'm a teapot"), "the store answered 418", False, True),
        (
            Exception("Error performing PUT http://169.254.169.254/latest/api/token"),
            "no keys are given; set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or the store's own",
            True,
            True,
        ),
        (
            Exception("Generic MicrosoftAzure error: MissingAccount"),
            "no account is given; set AZURE_STORAGE_ACCOUNT_NAME",
            True,
            False,
        ),
        (
            Exception("HTTP error: error sending request (kind: Timeout)"),
            "the store takes too long; ROLLCLI_STORE_TIMEOUT sets the seconds it may take",
            True,
            False,
        ),
        (
            Exception("HTTP error: error sending request"),
            "the store does not answer; check the network and the endpoint",
            True,
            False,
        ),
        (
            Exception("Connection refused"),
            "the store does not answer; check the network and the endpoint",
            True,
            False,
        ),
        (
            Exception("error reading a body from connection"),
            "the store does not answer; check the network and the endpoint",
            True,
            False,
        ),
        (Exception("error decoding response body"), "the answer of the store was cut short", False, False),
        (Exception("something else"), "the store refused the request", False, False),
    ],
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
