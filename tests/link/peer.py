"""A peer of a link that is not Leo: aioquic, another implementation of QUIC and of TLS. Each command writes lines of JSON.

    peer.py sign FOLDER              signs certificates in a folder of link_keys.sh: expired, early, and so on
    peer.py connect PORT PROTOCOL FOLDER NAME..     connects once with each certificate ("none" shows none), one by one
    peer.py serve PROTOCOL FOLDER NAME..            awaits a connection with each; the ports first
    peer.py initials PORT PROTOCOL FOLDER COUNT SECONDS     so many first packets over and over, whose answers are only counted
    peer.py stall PORT PROTOCOL FOLDER ADDRESSES EACH [ADDRESS PER_SECOND]
                                     proves its addresses, and goes no further: at once, or from one address at a pace
    peer.py crowd PORT PROTOCOL FOLDER ADDRESSES PER_SECOND SECONDS FULL
                                     the same from these addresses in turn, which repeat their packets in time

A flood first says that it begins, and at its end what came of it. What comes of a connection is "talked to" where a pulse of the link came, and else how it ended: the number of the alert
of TLS, or why there is none.
"""

import datetime
import heapq
import json
import selectors
import socket
import sys
import time

from aioquic.buffer import Buffer
from aioquic.quic import events
from aioquic.quic.configuration import QuicConfiguration
from aioquic.quic.connection import QuicConnection
from aioquic.quic.packet import QuicPacketType, pull_quic_header
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

FIRST_ALERT = 0x100
PATIENCE_S = 60.0
# The time that a server gives a handshake.
HANDSHAKE_S = 10.0
DAY = datetime.timedelta(days=1)
SERVER, CLIENT = ExtendedKeyUsageOID.SERVER_AUTH, ExtendedKeyUsageOID.CLIENT_AUTH
BOTH = [SERVER, CLIENT]


def tell(**what):
    print(json.dumps(what), flush=True)


# Certificates


def sign(folder):
    """One certificate each that differs from the right one in one thing."""
    now = datetime.datetime.now(datetime.timezone.utc)
    with open(f"{folder}/authority.pem", "rb") as file:
        authority = x509.load_pem_x509_certificate(file.read())
    with open(f"{folder}/authority.key", "rb") as file:
        authority_key = serialization.load_pem_private_key(file.read(), None)

    def make(name, purposes=BOTH, host="localhost", days=(-1, 9), signer="authority", is_authority=None):
        key = ec.generate_private_key(ec.SECP256R1())
        subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
        by_itself = signer == "itself"
        stranger = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "another authority")])
        issuers = {"authority": authority.subject, "itself": subject, "stranger": stranger}
        issuer = issuers.get(signer, authority.subject)
        made = x509.CertificateBuilder().subject_name(subject).issuer_name(issuer).public_key(key.public_key())
        made = made.serial_number(x509.random_serial_number())
        made = made.not_valid_before(now + days[0] * DAY).not_valid_after(now + days[1] * DAY)
        made = made.add_extension(x509.SubjectAlternativeName([x509.DNSName(host)]), critical=False)
        if purposes:
            made = made.add_extension(x509.ExtendedKeyUsage(purposes), critical=False)
        if is_authority is not None:
            made = made.add_extension(x509.BasicConstraints(ca=is_authority, path_length=None), critical=True)
        signers = {"authority": authority_key, "itself": key}
        made = made.sign(signers.get(signer, ec.generate_private_key(ec.SECP256R1())), hashes.SHA256())
        pem, form = serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8
        with open(f"{folder}/{name}.pem", "wb") as file:
            file.write(made.public_bytes(pem))
        with open(f"{folder}/{name}.key", "wb") as file:
            file.write(key.private_bytes(pem, form, serialization.NoEncryption()))

    make("right")
    make("expired", days=(-9, -1))
    make("early", days=(1, 9))
    make("self-signed", signer="itself")
    make("self-made", signer="itself", is_authority=True)
    make("stranger", signer="stranger")
    # Of another authority that has the same name: the script gives all of them one.
    make("namesake", signer="namesake")
    make("server", purposes=[SERVER])
    make("client", purposes=[CLIENT])
    make("any", purposes=[])
    make("other-name", host="elsewhere.example")


# Connections


def configuration(protocol, folder, name, is_client):
    made = QuicConfiguration(
        is_client=is_client,
        alpn_protocols=[protocol] if protocol else None,
        max_datagram_frame_size=65535,
        server_name="localhost",
        idle_timeout=PATIENCE_S,
    )
    # That of the robot's certificate; where there is another one, its owner takes the robot for a stranger.
    made.cafile = f"{folder}/authority.pem"
    if name != "none":
        made.load_cert_chain(f"{folder}/{name}.pem", f"{folder}/{name}.key")
    return made


def alert(code):
    return code - FIRST_ALERT if FIRST_ALERT <= code < FIRST_ALERT + 0x100 else None


class Conversation:
    """One connection over one socket, until something comes of it."""

    def __init__(self, connection, endpoint, came=None):
        self.connection, self.socket, self.came = connection, endpoint, came

    def flush(self):
        for data, address in self.connection.datagrams_to_send(now=time.monotonic()):
            self.socket.sendto(data, address)

    def receive(self, data, address):
        self.connection.receive_datagram(data, address, now=time.monotonic())

    def advance(self):
        timer = self.connection.get_timer()
        if timer is not None and timer <= time.monotonic():
            self.connection.handle_timer(now=time.monotonic())
        while (event := self.connection.next_event()) is not None and self.came is None:
            if isinstance(event, events.DatagramFrameReceived):
                self.came = {"came": "talked to"}
            elif isinstance(event, events.ConnectionTerminated):
                self.came = {"came": "ended", "alert": alert(event.error_code), "reason": event.reason_phrase}
        self.flush()


def talk(conversation):
    """Until something comes of a connection that this side makes."""
    end = time.monotonic() + PATIENCE_S
    conversation.flush()
    conversation.socket.settimeout(0.02)
    while conversation.came is None and time.monotonic() < end:
        try:
            conversation.receive(*conversation.socket.recvfrom(65536))
        except TimeoutError:
            pass
        conversation.advance()
    conversation.connection.close()
    conversation.flush()
    return conversation.came or {"came": "nothing"}


def connect(port, protocol, folder, names):
    for name in names:
        endpoint = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        connection = QuicConnection(configuration=configuration(protocol, folder, name, True))
        since = time.monotonic()
        connection.connect(("127.0.0.1", port), now=since)
        came = talk(Conversation(connection, endpoint))
        tell(name=name, seconds=time.monotonic() - since, **came)


def serve(protocol, folder, names):
    """Awaits connections for as long as there is somebody who reads what comes of them."""
    selector = selectors.DefaultSelector()
    for name in names:
        endpoint = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        endpoint.bind(("127.0.0.1", 0))
        tell(name=name, port=endpoint.getsockname()[1])
        selector.register(endpoint, selectors.EVENT_READ, (name, {}))
    selector.register(sys.stdin, selectors.EVENT_READ, None)
    while True:
        for key, _ in selector.select(0.02):
            if key.data is None:
                return
            name, conversations = key.data
            data, address = key.fileobj.recvfrom(65536)
            header = pull_quic_header(Buffer(data=data), host_cid_length=8)
            if address not in conversations:
                if header.packet_type != QuicPacketType.INITIAL:
                    continue
                connection = QuicConnection(
                    configuration=configuration(protocol, folder, name, False),
                    original_destination_connection_id=header.destination_cid,
                )
                conversations[address] = Conversation(connection, key.fileobj)
            conversations[address].receive(data, address)
        for key in list(selector.get_map().values()):
            if key.data is not None:
                name, conversations = key.data
                for conversation in conversations.values():
                    was = conversation.came
                    conversation.advance()
                    if conversation.came != was:
                        tell(name=name, **conversation.came)


# Floods


def begun(port, protocol, folder):
    """A connection of which the first packet is to be sent."""
    connection = QuicConnection(configuration=configuration(protocol, folder, "none", True))
    connection.connect(("127.0.0.1", port), now=time.monotonic())
    return connection, [data for data, _ in connection.datagrams_to_send(now=time.monotonic())]


def initials(port, protocol, folder, count, seconds):
    endpoint = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    endpoint.bind(("127.0.0.2", 0))
    endpoint.setblocking(False)
    packets = [data for _ in range(count) for data in begun(port, protocol, folder)[1]]
    counts = {"sent": 0, "sent_bytes": 0, "answers": 0, "answered_bytes": 0, "retries": 0}
    tell(begins=True)
    end, place = time.monotonic() + seconds, 0

    def read():
        try:
            while True:
                data = endpoint.recv(65536)
                header = pull_quic_header(Buffer(data=data), host_cid_length=8)
                counts["answers"] += 1
                counts["answered_bytes"] += len(data)
                counts["retries"] += header.packet_type == QuicPacketType.RETRY
        except BlockingIOError:
            pass

    while time.monotonic() < end:
        for _ in range(32):
            data = packets[place % len(packets)]
            place += 1
            try:
                endpoint.sendto(data, ("127.0.0.1", port))
            except BlockingIOError:
                break
            counts["sent"] += 1
            counts["sent_bytes"] += len(data)
        read()
    time.sleep(0.5)
    read()
    tell(**counts)


def stall(port, protocol, folder, addresses, each, address=None, per_second=None):
    """From each of these addresses so many handshakes, of which the client's last part never comes."""
    counts = {"begun": 0, "proven": 0, "answered": 0}
    selector = selectors.DefaultSelector()
    waiting = []
    for number in range(addresses):
        endpoint = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        endpoint.bind((address or f"127.1.{number // 250}.{number % 250 + 1}", 0))
        endpoint.setblocking(False)
        of_address = {}
        selector.register(endpoint, selectors.EVENT_READ, of_address)
        waiting += [(endpoint, of_address, *begun(port, protocol, folder)) for _ in range(each)]
    # One of each address, and then the next of each.
    waiting = [one for turn in range(each) for one in waiting[turn::each]]
    tell(begins=True)
    since = time.monotonic()

    def read(timeout):
        for key, _ in selector.select(timeout):
            try:
                data, address = key.fileobj.recvfrom(65536)
            except BlockingIOError:
                continue
            header = pull_quic_header(Buffer(data=data), host_cid_length=8)
            connection = key.data.get(header.destination_cid)
            if connection is None:
                continue
            if header.packet_type == QuicPacketType.RETRY:
                connection.receive_datagram(data, address, now=time.monotonic())
                for packet, _ in connection.datagrams_to_send(now=time.monotonic()):
                    key.fileobj.sendto(packet, address)
                counts["proven"] += 1
            else:
                # The server's part of the handshake: it is in memory there from now on.
                counts["answered"] += 1
                del key.data[header.destination_cid]

    for endpoint, of_address, connection, packets in waiting:
        of_address[connection.host_cid] = connection
        for packet in packets:
            endpoint.sendto(packet, ("127.0.0.1", port))
        counts["begun"] += 1
        read(0)
        while per_second and time.monotonic() < since + counts["begun"] / per_second:
            read(0.005)
    last = time.monotonic()
    while time.monotonic() < last + 0.5:
        before = dict(counts)
        read(0.05)
        if counts != before:
            last = time.monotonic()
    tell(seconds=last - since, **counts)


def crowd(port, protocol, folder, addresses, per_second, seconds, full):
    """Handshakes of many addresses that the server keeps for as long as any. Begins once so many were answered."""
    counts = {"begun": 0, "proven": 0}
    selector = selectors.DefaultSelector()
    endpoints = []
    for number in range(addresses):
        endpoint = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        endpoint.bind((f"127.1.{number // 250}.{number % 250 + 1}", 0))
        endpoint.setblocking(False)
        endpoints.append(endpoint)
        selector.register(endpoint, selectors.EVENT_READ)
    # Handshakes in progress by their identifiers; when each is repeated; and those that were answered.
    in_progress, timers, answered = {}, [], set()
    since = time.monotonic()
    has_begun = False

    def send(key):
        connection, endpoint, _ = in_progress[key]
        for packet, _ in connection.datagrams_to_send(now=time.monotonic()):
            endpoint.sendto(packet, ("127.0.0.1", port))
        heapq.heappush(timers, (connection.get_timer(), key))

    while (now := time.monotonic()) < since + seconds:
        if not has_begun and len(answered) >= full:
            has_begun = True
            tell(begins=True)
        if counts["begun"] < (now - since) * per_second:
            connection = QuicConnection(configuration=configuration(protocol, folder, "none", True))
            connection.connect(("127.0.0.1", port), now=now)
            in_progress[connection.host_cid] = (connection, endpoints[counts["begun"] % addresses], now)
            send(connection.host_cid)
            counts["begun"] += 1
        while timers and timers[0][0] <= now:
            _, key = heapq.heappop(timers)
            if key not in in_progress:
                continue
            connection, _, begun_at = in_progress[key]
            if now > begun_at + HANDSHAKE_S:
                del in_progress[key]
            elif connection.get_timer() <= now:
                # A constant period: the doubling one exceeds the silence that the server allows.
                connection._loss._pto_count = 1
                connection.handle_timer(now=now)
                send(key)
        for key, _ in selector.select(0.002):
            data, address = key.fileobj.recvfrom(65536)
            header = pull_quic_header(Buffer(data=data), host_cid_length=8)
            if header.destination_cid not in in_progress:
                continue
            if header.packet_type == QuicPacketType.RETRY:
                in_progress[header.destination_cid][0].receive_datagram(data, address, now=time.monotonic())
                send(header.destination_cid)
                counts["proven"] += 1
            else:
                answered.add(header.destination_cid)
    tell(**counts, answered=len(answered))


def main():
    command, *words = sys.argv[1:]
    if command == "sign":
        sign(words[0])
    elif command == "connect":
        connect(int(words[0]), words[1], words[2], words[3:])
    elif command == "serve":
        serve(words[0], words[1], words[2:])
    elif command == "initials":
        initials(int(words[0]), words[1], words[2], int(words[3]), float(words[4]))
    elif command == "stall":
        pace = (words[5], float(words[6])) if len(words) > 5 else ()
        stall(int(words[0]), words[1], words[2], int(words[3]), int(words[4]), *pace)
    elif command == "crowd":
        crowd(int(words[0]), words[1], words[2], int(words[3]), float(words[4]), float(words[5]), int(words[6]))


main()
