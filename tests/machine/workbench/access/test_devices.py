"""What a paired device is called."""

import pytest

from machine.workbench.access.pairing import device_name

IPHONE = "Mozilla/5.0 (iPhone; CPU iPhone OS 17_5 like Mac OS X) AppleWebKit/605.1.15 (KHTML, like Gecko) Version/17.5 Mobile/15E148 Safari/604.1"  # noqa: E501
ANDROID = "Mozilla/5.0 (Linux; Android 10; K) AppleWebKit/537.36 (KHTML, like Gecko) Chrome/126.0.0.0 Mobile Safari/537.36"
FIREFOX = "Mozilla/5.0 (X11; Linux x86_64; rv:127.0) Gecko/20100101 Firefox/127.0"
EDGE = "Mozilla/5.0 (Windows NT 10.0; Win64; x64) AppleWebKit/537.36 (KHTML, like Gecko) Chrome/126.0.0.0 Safari/537.36 Edg/126.0"


@pytest.mark.parametrize(
    ("user_agent", "name"),
    [
        (IPHONE, "iPhone, Safari"),
        (ANDROID, "Android, Chrome"),
        (FIREFOX, "Linux, Firefox"),
        (EDGE, "Windows, Edge"),
        ("curl/8.5.0", "a device"),
        ("", "a device"),
        ("<script>iPad\x1b[2J", "iPad"),
    ],
)
def test_a_device_is_called_by_words_of_ours_alone(user_agent: str, name: str) -> None:
    assert device_name(user_agent) == name
