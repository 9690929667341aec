import { create, fromBinary, type MessageInitShape, toBinary } from "@bufbuild/protobuf";
import { type Reply, ReplySchema, type Request, RequestSchema } from "../../gen/limber/v1/service_pb";
import { LimberError } from "./errors";
import { isGone, isOfOlderServer, mayBeLong, PART_BYTES, wholeReply } from "./reply_parts";
import { Socket, type SocketState } from "./socket";

type Body = Exclude<Request["body"], { case: undefined }>;
export type Kind = Body["case"];
type InitBody = Exclude<
  NonNullable<Exclude<MessageInitShape<typeof RequestSchema>, Request>["body"]>,
  { case?: undefined } | Request["body"]
>;
export type Init<K extends Kind> = Extract<InitBody, { case: K }>["value"];
export type Response<K extends Kind> = Extract<Reply["body"], { case: K }>["value"];

interface Pending {
  data: Uint8Array;
  isSent: boolean;
  resolve(reply: Reply): void;
  reject(error: LimberError): void;
  timer: number;
}

const VERSION = 1;
const TIMEOUT_MS = 15_000;
/** Number of requests for a long answer whose parts were lost with a connection. */
const TRIES = 3;

function randomText(): string {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Throws the server's refusal. */
function answerOf<K extends Kind>(kind: K, { body }: Reply): Response<K> {
  if (body.case === "error") throw LimberError.from(body.value);
  if (body.case !== kind) throw new LimberError("MALFORMED", `the answer to ${kind} is ${body.case}`);
  return body.value as Response<K>;
}

/**
 * Requests to limberd, many in flight. A request without an answer when the connection is lost is sent again under the
 * same id on the next one: the server applies changes once (docs/protocol.md, Repeated requests).
 */
export class Connection {
  /** The run of limberd that answered last; another one means that its sessions do not exist any more. */
  instance = "";
  /** Name of this page that others in a session see; empty: the server finds a name. */
  clientName = "";
  /** The run of an older limberd, whose answers do not come in parts. */
  private withoutParts = "";
  private nextId = 1n;
  private readonly client = randomText();
  private readonly pending = new Map<bigint, Pending>();
  private readonly socket: Socket;

  constructor(
    url: string,
    private readonly changed: (state: SocketState) => void,
    private readonly restarted: () => void,
  ) {
    this.socket = new Socket(url, {
      opened: () => this.sendWaiting(),
      received: (data) => this.receive(data),
      changed: (state) => {
        if (state === "lost") for (const one of this.pending.values()) one.isSent = false;
        this.changed(state);
      },
    });
  }

  /**
   * Sends one request; rejects with LimberError. timeout [ms]: for all of it, a lost connection included, but for the
   * parts of a long answer, each of which has as much.
   */
  async call<K extends Kind>(kind: K, value: Init<K>, timeout = TIMEOUT_MS): Promise<Response<K>> {
    for (let attempt = 0; mayBeLong(kind) && attempt < TRIES; attempt++) {
      if (this.withoutParts !== "" && this.withoutParts === this.instance) break;
      try {
        const reply = await this.ask(kind, value, timeout, PART_BYTES.least);
        if (reply.body.case !== "getReplyPart") return answerOf(kind, reply);
        const next = (part: Init<"getReplyPart">) => this.call("getReplyPart", part, timeout);
        return answerOf(kind, fromBinary(ReplySchema, await wholeReply(reply.body.value, next)));
      } catch (error) {
        if (isOfOlderServer(error)) this.withoutParts = this.instance;
        else if (!isGone(error)) throw error;
      }
    }
    return answerOf(kind, await this.ask(kind, value, timeout, 0));
  }

  private ask<K extends Kind>(kind: K, value: Init<K>, timeout: number, mostReplyBytes: number): Promise<Reply> {
    const id = this.nextId++;
    const body = { case: kind, value } as unknown as Body;
    const { client, clientName } = this;
    const data = toBinary(
      RequestSchema,
      create(RequestSchema, { version: VERSION, id, client, clientName, mostReplyBytes: BigInt(mostReplyBytes), body }),
    );
    return new Promise<Reply>((resolve, reject) => {
      const timer = window.setTimeout(() => {
        this.pending.delete(id);
        const why = this.socket.isOpen ? "the server did not answer in time" : "there is no connection to the server";
        reject(new LimberError("TIMEOUT", why));
      }, timeout);
      this.pending.set(id, { data, isSent: this.socket.send(data), resolve, reject, timer });
    });
  }

  retry(): void {
    this.socket.retry();
  }

  close(): void {
    this.socket.close();
    for (const one of this.pending.values()) {
      window.clearTimeout(one.timer);
      one.reject(new LimberError("CANCELLED", "the connection was closed"));
    }
    this.pending.clear();
  }

  private sendWaiting(): void {
    for (const one of this.pending.values()) if (!one.isSent) one.isSent = this.socket.send(one.data);
  }

  private receive(data: Uint8Array): void {
    const reply = fromBinary(ReplySchema, data);
    this.heard(reply.instance);
    const waiting = this.pending.get(reply.id);
    if (!waiting) return;
    this.pending.delete(reply.id);
    window.clearTimeout(waiting.timer);
    waiting.resolve(reply);
  }

  /** Every reply and every stream message names the run of the server. */
  heard(instance: string): void {
    if (!instance || instance === this.instance) return;
    const isAnother = this.instance !== "";
    this.instance = instance;
    if (isAnother) this.restarted();
  }
}
