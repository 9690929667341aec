"""Those who follow streams by bare messages, and read them when a test says so."""

import secrets

import zmq
from limber.v1.follow_pb2 import FollowedTopic, FollowRequest, StreamPosition
from limber.v1.service_pb2 import Reply, Request
from limber.v1.stream_pb2 import StreamMessage

SMALL_WINDOW = 64 << 10


class Follower:
    """A DEALER that follows topics. Its socket takes little, so that what is not read stays at the server."""

    def __init__(self, endpoint, topics, window=SMALL_WINDOW, name="a follower"):
        self.context = zmq.Context()
        self.name, self.window, self.client_name = secrets.token_hex(8), window, name
        self.topics = dict.fromkeys(topics, 0)
        self.endpoint, self.instance = endpoint, ""
        self.read_bytes = self.left_out = 0
        self.messages = []  # (topic, StreamMessage)
        self.connect()

    def connect(self):
        self.socket = self.context.socket(zmq.DEALER)
        self.socket.linger = 0
        self.socket.rcvbuf = 4096
        self.socket.rcvhwm = 1
        self.socket.connect(self.endpoint)

    def ask(self, **more):
        topics = [FollowedTopic(prefix=topic, after=after) for topic, after in self.topics.items()]
        request = FollowRequest(stream=self.name, read_bytes=self.read_bytes, window_bytes=self.window, topics=topics,
                                instance=self.instance)
        request.MergeFrom(FollowRequest(**more))
        self.socket.send(Request(version=1, client_name=self.client_name, follow=request).SerializeToString())

    def receive(self, timeout=10.0):
        """The next reply or message; None after the timeout [s]."""
        if not self.socket.poll(int(1000 * timeout)):
            return None
        parts = self.socket.recv_multipart()
        if len(parts) == 1:
            return Reply.FromString(parts[0])
        topic, message = parts[0].decode(), StreamMessage.FromString(parts[1])
        position = StreamPosition.FromString(parts[2])
        self.read_bytes, self.left_out, self.instance = position.sent_bytes, position.left_out, message.instance
        if topic in self.topics:
            self.topics[topic] = message.sequence
        self.messages.append((topic, message))
        return topic, message

    def follow(self, **more):
        """@returns the answer, after the messages before it."""
        self.ask(**more)
        while True:
            got = self.receive()
            assert got is not None, "no answer"
            if isinstance(got, Reply):
                assert got.WhichOneof("body") == "follow", got
                return got.follow

    def close(self):
        self.context.destroy(linger=0)
