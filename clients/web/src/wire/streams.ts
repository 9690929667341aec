import { fromBinary } from "@bufbuild/protobuf";
import { type StreamMessage, StreamMessageSchema } from "../../gen/limber/v1/stream_pb";
import { Socket } from "./socket";

export type Listener = (message: StreamMessage) => void;

const encoder = new TextEncoder();
const decoder = new TextDecoder();

/** One byte (1: subscribe, 0: no more), then the topic. */
export function subscription(topic: string, isOn: boolean): Uint8Array {
  const text = encoder.encode(topic);
  const data = new Uint8Array(1 + text.length);
  data[0] = isOn ? 1 : 0;
  data.set(text, 1);
  return data;
}

/** A message down: length of the topic in one byte, the topic, the StreamMessage. */
export function unpack(data: Uint8Array): { topic: string; message: Uint8Array } {
  const end = 1 + (data[0] ?? 0);
  return { topic: decoder.decode(data.subarray(1, end)), message: data.subarray(end) };
}

/** Topics of the server, subscribed to again on every new connection. */
export class Streams {
  bytes = 0;
  private readonly listeners = new Map<string, Listener>();
  private readonly socket: Socket;

  constructor(
    url: string,
    private readonly heard: (instance: string) => void,
    reconnected: () => void,
  ) {
    let isFirst = true;
    this.socket = new Socket(url, {
      opened: () => {
        for (const topic of this.listeners.keys()) this.socket.send(subscription(topic, true));
        if (!isFirst) reconnected();
        isFirst = false;
      },
      received: (data) => this.receive(data),
      changed: () => undefined,
    });
  }

  /** One listener a topic. */
  subscribe(topic: string, listener: Listener): void {
    this.listeners.set(topic, listener);
    this.socket.send(subscription(topic, true));
  }

  unsubscribe(topic: string): void {
    if (this.listeners.delete(topic)) this.socket.send(subscription(topic, false));
  }

  retry(): void {
    this.socket.retry();
  }

  close(): void {
    this.listeners.clear();
    this.socket.close();
  }

  private receive(data: Uint8Array): void {
    this.bytes += data.byteLength;
    const { topic, message } = unpack(data);
    const decoded = fromBinary(StreamMessageSchema, message);
    this.heard(decoded.instance);
    this.listeners.get(topic)?.(decoded);
  }
}
