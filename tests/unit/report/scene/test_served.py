"""Where a browser finds a result, and places at which nothing can listen."""

from __future__ import annotations

import socket
from typing import Any

import pytest

from fingerslip.errors import InputError
from fingerslip.report.scene.options import LOCAL, Served, require_free


def test_only_this_machine_can_look_unless_told_otherwise() -> None:
    assert Served().host == LOCAL == "127.0.0.1"


@pytest.mark.parametrize("host", [LOCAL, "localhost", "0.0.0.0"])
def test_a_free_port_is_taken(host: str) -> None:
    require_free(Served(host, 0))


def test_a_port_in_use_is_refused() -> None:
    with socket.create_server((LOCAL, 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=f"--port: port {port} is in use at 127.0.0.1, needs .*; write --port 0"):
            require_free(Served(LOCAL, port))
    require_free(Served(LOCAL, port))


@pytest.mark.parametrize("port", [-1, 65536, 10**9])
def test_a_number_that_is_no_port_is_refused(port: int) -> None:
    with pytest.raises(InputError, match=f"view: --port: got {port}, needs a number from 0 to 65535; 0 takes"):
        require_free(Served(LOCAL, port))


def test_a_port_of_the_system_is_refused_where_the_system_does(monkeypatch: pytest.MonkeyPatch) -> None:
    def bind(*_: Any) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(socket.socket, "bind", bind)
    with pytest.raises(InputError, match="port 80 is reserved for the system, needs one from 1024 to 65535"):
        require_free(Served(LOCAL, 80))


@pytest.mark.parametrize("host", ["192.0.2.1", "no such host", "a" * 300, "256.1.1.1"])
def test_a_host_that_is_not_this_machine_is_refused(host: str) -> None:
    with pytest.raises(InputError, match=r"view: --host: .* is no address of this machine, needs one, such as 127"):
        require_free(Served(host, 0))
