"""A ROUTER and an XPUB in a thread. It knows nothing of elastic bodies; tests say what each request is answered with."""

import threading

import zmq
from limber.v1 import presence_pb2 as presence
from limber.v1 import service_pb2 as service
from limber.v1 import stream_pb2 as stream


class FakeServer:
    """handlers: body name -> function(request) -> response message, Reply, bytes, or None for silence."""

    def __init__(self, folder):
        self.requests = f"ipc://{folder}/requests"
        self.stream = f"ipc://{folder}/stream"
        self.seen = []
        self.handlers = {"get_server_info": self.info,
                         "join_session": lambda request: presence.JoinSessionResponse(client=1)}
        self.versions = [1]
        self.subscribed = threading.Event()
        self._context = zmq.Context()
        self._publish_lock = threading.Lock()

    def info(self, request):
        return service.GetServerInfoResponse(server_version="fake", protocol_versions=self.versions,
                                             stream_endpoint=self.stream)

    def __enter__(self):
        self._router = self._context.socket(zmq.ROUTER)
        self._router.linger = 0
        self._router.bind(self.requests)
        self._xpub = self._context.socket(zmq.XPUB)
        self._xpub.linger = 0
        self._xpub.bind(self.stream)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()
        return self

    def __exit__(self, *exc):
        self._stop.set()
        self._thread.join(10)
        self._context.destroy(linger=0)

    def publish(self, topic, message):
        if isinstance(message, stream.StreamMessage):
            message = message.SerializeToString()
        with self._publish_lock:
            self._xpub.send_multipart([topic.encode(), message])

    def reply(self, envelope, request, answer):
        if isinstance(answer, bytes):
            data = answer
        elif isinstance(answer, service.Reply):
            data = answer.SerializeToString()
        else:
            kind = request.WhichOneof("body")
            data = service.Reply(version=1, id=request.id, **{kind: answer}).SerializeToString()
        self._router.send_multipart([envelope, data])

    def _run(self):
        while not self._stop.is_set():
            if self._router.poll(20):
                envelope, *_, data = self._router.recv_multipart()
                request = service.Request.FromString(data)
                kind = request.WhichOneof("body")
                self.seen.append(kind)
                handler = self.handlers.get(kind)
                answer = handler(request) if handler else None
                for one in answer if isinstance(answer, list) else [answer]:
                    if one is not None:
                        self.reply(envelope, request, one)
            with self._publish_lock:
                while self._xpub.poll(0):
                    if self._xpub.recv().startswith(b"\x01session"):
                        self.subscribed.set()
