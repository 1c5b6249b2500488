"""A Zenoh session reduced to our needs; the only module that imports zenoh.

Rules of this file: callbacks only hand on, always through Zenoh's own queue (``indirect``), never on its receiving
thread; a session is closed by ``with``, for one that is not keeps the interpreter from ending; publishers are
declared once per key; whatever Zenoh raises leaves here as an error of ours.
"""

import json
import re
import threading
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import NoReturn, Self

import zenoh

from tramnet_protocol.channel import Lane, Query
from tramnet_protocol.errors import (
    AddressInUse,
    BadEndpoint,
    BadKey,
    CannotConnect,
    ChannelClosed,
    MessageTooLarge,
    NoAnswer,
)
from tramnet_protocol.keys import check_network
from tramnet_protocol.limits import MAX_MESSAGE_BYTES
from tramnet_protocol.security import Credentials
from tramnet_protocol.settings import (
    PRIVATE,
    Settings,
    client_settings,
    protocol_of,
    root_settings,
)
from tramnet_protocol.tokens import TokenView

_CONGESTION = {
    Lane.LINK: zenoh.CongestionControl.BLOCK,
    Lane.CONTROL: zenoh.CongestionControl.BLOCK,
    Lane.TELEMETRY: zenoh.CongestionControl.DROP,
}
_PRIORITY = {
    Lane.LINK: zenoh.Priority.DATA,
    Lane.CONTROL: zenoh.Priority.REAL_TIME,
    Lane.TELEMETRY: zenoh.Priority.BACKGROUND,
}
_SOURCE_LINE = re.compile(r"\s+at /\S+\.rs:\d+\.?")
_ANY_INTERFACE = {"0.0.0.0": "127.0.0.1", "[::]": "[::1]"}
_LOCAL_ANSWER_SECONDS = 5.0


def open_root(
    network: str,
    listen: Sequence[str],
    observers: Sequence[str] = (),
    credentials: Credentials | None = None,
) -> "ZenohChannel":
    """Open the root's end of a network.

    Args:
        network: Name of the network.
        listen: Endpoints at which workers connect; port 0 takes a free one.
        observers: Endpoints at which observers attach, of protocols that no worker uses. Whatever is sent to them
            is dropped rather than waited for.
        credentials: Where given, workers must show certificates, and may do what the list of seats says.

    Raises:
        BadKey: The name of the network is none.
        BadEndpoint: An endpoint cannot be listened on; ``AddressInUse`` where somebody else does.
        BadCredentials: The list of seats cannot be used.
    """
    check_network(network)
    endpoints = [*listen, *observers]
    try:
        session = _open(root_settings(network, listen, observers, credentials))
    except zenoh.ZError as error:
        _refuse_endpoint(endpoints, error)
    try:
        return ZenohChannel(session, _real_endpoints(session, endpoints))
    except BaseException:
        session.close()  # type: ignore[no-untyped-call]
        raise


def open_worker(connect: str, credentials: Credentials | None = None) -> "ZenohChannel":
    """Open a worker's end of a network; it connects again by itself when the root comes back there.

    Args:
        connect: Endpoint of the root.
        credentials: What it shows of itself, where the root asks for certificates.

    Raises:
        CannotConnect: Nobody listens there, or the root refuses.
        BadEndpoint: It is no endpoint.
    """
    return _open_client("tramnet worker", connect, credentials)


def open_observer(connect: str, credentials: Credentials | None = None) -> "ZenohChannel":
    """Open an observer's end of a network.

    Args:
        connect: One of the root's endpoints for observers.
        credentials: The root's own, where it is watched from elsewhere and asks for certificates.

    Raises:
        CannotConnect: Nobody listens there, or the root refuses.
        BadEndpoint: It is no endpoint.
    """
    return _open_client("tramnet observer", connect, credentials)


class ZenohChannel:
    """A channel over Zenoh; see ``Channel`` for what its methods promise.

    Attributes:
        endpoints: Where this node is reached from this machine: those for workers first, those for observers last.
    """

    def __init__(self, session: zenoh.Session, endpoints: tuple[str, ...] = ()) -> None:
        self._session = session
        self._is_client = not endpoints
        self._lock = threading.Lock()
        self._publishers: dict[tuple[str, Lane], zenoh.Publisher] = {}
        self._tokens: dict[str, zenoh.LivelinessToken] = {}
        self._receivers: list[object] = []  # subscribers and queryables end when forgotten
        self.endpoints = endpoints

    @property
    def endpoint(self) -> str:
        """Where a worker on this machine connects."""
        return self.endpoints[0]

    def publish(self, key: str, payload: bytes, lane: Lane) -> None:
        """Send a message to whoever subscribes to a key, if anybody does."""
        _check_size(payload)
        try:
            publisher = self._publishers.get((key, lane)) or self._declare_publisher(key, lane)
            publisher.put(payload)
        except zenoh.ZError as error:
            self._fail("publish", key, error)

    def subscribe(self, key: str, deliver: Callable[[str, bytes], None]) -> None:
        """Have messages whose key matches a pattern delivered: key and payload."""

        def hand_on(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT:
                deliver(str(sample.key_expr), sample.payload.to_bytes())

        try:
            self._receivers.append(self._session.declare_subscriber(key, hand_on))
        except zenoh.ZError as error:
            self._fail("subscribe", key, error)

    def declare_token(self, key: str) -> None:
        """Show presence under a key until it is withdrawn, the channel closes or the process ends."""
        try:
            self._tokens[key] = self._session.liveliness().declare_token(key)
        except zenoh.ZError as error:
            self._fail("declare a token", key, error)

    def withdraw_token(self, key: str) -> None:
        """End the presence under a key, if there is one."""
        token = self._tokens.pop(key, None)
        if token is not None and not self._session.is_closed():
            token.undeclare()  # type: ignore[no-untyped-call]

    def watch_tokens(self, key: str, deliver: Callable[[str, bool], None]) -> None:
        """Have the tokens that match a pattern delivered: key, and whether it appears or disappears."""
        view = TokenView(deliver)

        def hand_on(sample: zenoh.Sample) -> None:
            view.change(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)

        try:
            if self._is_client:
                self._receivers.append(self._watch_connection(view))
            liveliness = self._session.liveliness()
            self._receivers.append(liveliness.declare_subscriber(key, hand_on))
            for reply in liveliness.get(key, timeout=_LOCAL_ANSWER_SECONDS):
                if reply.ok is not None:
                    view.found(str(reply.ok.key_expr))
        except zenoh.ZError as error:
            self._fail("watch tokens", key, error)

    def serve(self, key: str, deliver: Callable[[Query], None]) -> None:
        """Have the questions to a key delivered."""
        try:
            queryable = self._session.declare_queryable(
                key, lambda query: deliver(_ZenohQuery(query))
            )
            self._receivers.append(queryable)
        except zenoh.ZError as error:
            self._fail("serve", key, error)

    def ask(self, key: str, payload: bytes, timeout: float) -> bytes:
        """Ask whoever serves a key, and wait for the answer at most ``timeout`` [s]."""
        _check_size(payload)
        try:
            replies = self._session.get(
                key,
                payload=payload,
                timeout=timeout,
                congestion_control=zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.REAL_TIME,
            )
            # To the end, for a handler that is left half read keeps its memory until the timeout.
            answers = [reply.ok for reply in replies]
        except zenoh.ZError as error:
            self._fail("ask", key, error)
        found = [answer for answer in answers if answer is not None]
        if found:
            return found[0].payload.to_bytes()
        raise NoAnswer(key, _why_no_answer(key, timed_out=bool(answers), timeout=timeout))

    def close(self) -> None:
        """Close the channel; a second call does nothing."""
        if not self._session.is_closed():
            # Zenoh tells clients of a token that its process dies with, not of one its session closes with.
            for key in tuple(self._tokens):
                self.withdraw_token(key)
            self._session.close()  # type: ignore[no-untyped-call]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _watch_connection(self, view: TokenView) -> object:
        """Take the end of a client's one connection for the end of all tokens: Zenoh says nothing of these."""

        def hand_on(event: zenoh.TransportEvent) -> None:
            if event.kind == zenoh.SampleKind.DELETE:
                view.lose_all()

        return self._session.info.declare_transport_events_listener(hand_on, history=False)

    def _declare_publisher(self, key: str, lane: Lane) -> zenoh.Publisher:
        with self._lock:
            if (key, lane) not in self._publishers:
                self._publishers[key, lane] = self._session.declare_publisher(
                    key, congestion_control=_CONGESTION[lane], priority=_PRIORITY[lane]
                )
            return self._publishers[key, lane]

    def _fail(self, action: str, key: str, error: zenoh.ZError) -> NoReturn:
        if self._session.is_closed():
            raise ChannelClosed(action) from error
        raise BadKey(f"cannot {action} on {key!r}: {_plain(error)}") from error


class _ZenohQuery:
    """A question that arrived over Zenoh."""

    __slots__ = ("_query", "key", "payload")

    def __init__(self, query: zenoh.Query) -> None:
        self._query = query
        self.key = str(query.key_expr)
        self.payload = b"" if query.payload is None else query.payload.to_bytes()

    def reply(self, payload: bytes) -> None:
        _check_size(payload)
        try:
            self._query.reply(self._query.key_expr, payload)
        except zenoh.ZError as error:
            raise ChannelClosed("answer") from error
        finally:
            self._query.drop()  # type: ignore[no-untyped-call]


def _open(settings: Settings) -> zenoh.Session:
    return zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))


def _open_client(name: str, connect: str, credentials: Credentials | None) -> ZenohChannel:
    try:
        return ZenohChannel(_open(client_settings(name, connect, credentials)))
    except zenoh.ZError as error:
        raise CannotConnect(
            connect,
            f"nobody answers at {connect} ({_plain(error)}); start the root there first, or see its "
            "run folder for the address it really has" + _or_refused(connect, credentials),
        ) from error


def _or_refused(connect: str, credentials: Credentials | None) -> str:
    """Return why a root may refuse who comes: of that, nothing but its own log can tell."""
    if protocol_of(connect) not in PRIVATE:
        return ""
    if credentials is None:
        return "; it asks for a certificate: name the folder that has one with --tls"
    return (
        f"; or it refuses the certificate of {credentials.name}, or its own is not of the same "
        "authority or not for this address"
    )


def _real_endpoints(session: zenoh.Session, wanted: Sequence[str]) -> tuple[str, ...]:
    """Return the endpoints a session listens on, in the order they were asked for, with their real ports."""
    replies = session.get(f"@/{session.zid()}/peer", timeout=_LOCAL_ANSWER_SECONDS)
    found = [json.loads(reply.ok.payload.to_string()) for reply in replies if reply.ok is not None]
    locators = [locator for entry in found for locator in entry["locators"]]
    return tuple(_real_endpoint(endpoint, locators) for endpoint in wanted)


def _real_endpoint(endpoint: str, locators: Sequence[str]) -> str:
    host, _, port = endpoint.rpartition(":")
    protocol, _, name = host.partition("/")
    if not host or "/" in port:
        return endpoint
    if int(port.partition("#")[0]) == 0:
        same = [locator for locator in locators if protocol_of(locator) == protocol]
        if not same:
            raise BadEndpoint(endpoint, f"cannot find the free port {endpoint} took; name a port")
        port = same[0].rpartition(":")[2]
    return f"{protocol}/{_ANY_INTERFACE.get(name, name)}:{port}"


def _refuse_endpoint(endpoints: Sequence[str], error: zenoh.ZError) -> NoReturn:
    text = _plain(error)
    endpoint = next((e for e in endpoints if e.partition("/")[2] in text), ", ".join(endpoints))
    if "Address already in use" in text or "Unable to acquire lock" in text:
        raise AddressInUse(endpoint) from error
    raise BadEndpoint(endpoint, f"cannot listen on {endpoint}: {text}") from error


def _check_size(payload: bytes) -> None:
    if len(payload) > MAX_MESSAGE_BYTES:
        raise MessageTooLarge(len(payload), MAX_MESSAGE_BYTES)


def _why_no_answer(key: str, timed_out: bool, timeout: float) -> str:
    if timed_out:
        return f"no answer to {key} within {timeout:g} s"
    return f"nobody answers to {key}; is the root of that network running?"


def _plain(error: zenoh.ZError) -> str:
    """Return the text of an error without the places in Zenoh's source."""
    return _SOURCE_LINE.sub("", str(error)).strip()
