"""What a store objects to, in one line that says what to do, without addresses, keys or signatures."""

import re

TIMEOUT_VARIABLE = "ROLLCLI_STORE_TIMEOUT"  # seconds a request may take
DENIED = "access is denied; check the rights of these keys"
_NO_BUCKET = "there is no such bucket"
_EXPIRED = "the keys have expired; fetch new ones"
_NO_OBJECT = "there is no such object"
_CUT = "the answer of the store was cut short"
_REFUSED = "the store refused the request"
_ANSWERED = "the store answered"
_CODES = {
    "NoSuchBucket": _NO_BUCKET,
    "AccessDenied": DENIED,
    "InvalidAccessKeyId": "the access key is unknown; check AWS_ACCESS_KEY_ID",
    "SignatureDoesNotMatch": "the secret key is wrong; check AWS_SECRET_ACCESS_KEY",
    "ExpiredToken": _EXPIRED,
    "ContainerNotFound": _NO_BUCKET,
    "AuthenticationFailed": "the keys are wrong or have expired; check AZURE_STORAGE_ACCOUNT_KEY",
    "InvalidAuthenticationInfo": _EXPIRED,
    "RequestTimeTooSkewed": "this machine's clock differs from the store's; set it",
    "PermanentRedirect": "the bucket is in another region; set AWS_REGION",
    "AuthorizationHeaderMalformed": "the bucket is in another region; set AWS_REGION",
    "IllegalLocationConstraintException": "the bucket is in another region; set AWS_REGION",
}
_NO_KEYS = "169.254.169.254"  # where machines of a cloud find theirs
_STATUS = re.compile(r"non-2xx status code: (\d+)")


def reason_of(error: Exception) -> str:
    """Say what a store objects to."""
    text = str(error)
    for code, meaning in _CODES.items():
        if f"<Code>{code}</Code>" in text:
            return meaning
    if _NO_KEYS in text or "metadata" in text.lower():
        return "no keys are given; set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or the store's own"
    if "301 Moved Permanently" in text or "redirect" in text.lower():
        return "the bucket is in another region; set AWS_REGION"
    if "MissingAccount" in text:
        return "no account is given; set AZURE_STORAGE_ACCOUNT_NAME"
    status = _STATUS.search(text)
    if status:
        meanings = {"401": "the keys are not accepted; check them", "403": DENIED}
        return meanings.get(status[1], f"{_ANSWERED} {status[1]}")
    if "kind: Timeout" in text:
        return f"the store takes too long; {TIMEOUT_VARIABLE} sets the seconds it may take"
    if "error sending request" in text or "onnect" in text:
        return "the store does not answer; check the network and the endpoint"
    return _CUT if "body" in text else _REFUSED


def what_is_missing(error: Exception) -> str:
    """Tell a bucket that does not exist from an object."""
    text = str(error)
    return _NO_BUCKET if "NoSuchBucket" in text or "ContainerNotFound" in text else _NO_OBJECT


def is_final(error: Exception) -> bool:
    """Tell whether a store would answer the same again: it has understood the request and refuses it."""
    text = str(error)
    if "redirect" in text.lower() or _NO_KEYS in text:
        return True
    status = _STATUS.search(text)
    passing = "<Code>RequestTimeout</Code>" in text or (status and status[1] in ("408", "429"))
    return status is not None and status[1].startswith("4") and not passing


def holds_for_all(reason: str) -> bool:
    """Tell whether what a store objects to holds for every object of its bucket."""
    of_one = reason in (DENIED, _NO_OBJECT, _CUT, _REFUSED) or reason.startswith(_ANSWERED)
    return not of_one
