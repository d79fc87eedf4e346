// The WebSocket to the simulation; it comes back when the connection is lost.

import { decode } from "./protocol.js";

const RETRY = 1000; // [ms]

export class Connection {
  constructor(listeners) {
    this.listeners = listeners;
    this.open();
  }

  open() {
    this.socket = new WebSocket(`ws://${location.host}/stream`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.listeners.connected(true);
    this.socket.onclose = () => {
      this.listeners.connected(false);
      setTimeout(() => this.open(), RETRY);
    };
    this.socket.onmessage = ({ data }) => {
      const message = typeof data === "string" ? JSON.parse(data) : decode(data);
      this.listeners[message.kind ?? message.type](message);
    };
  }

  send(type, fields = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ type, ...fields }));
  }
}
