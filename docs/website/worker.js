// Lets the search work in pages opened from the file system, where browsers start no workers: a hidden frame in their place.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.appendChild(frame);
      const begun = frame.contentDocument;
      begun.open();
      begun.write(
        `<script>self.hear = self.postMessage.bind(self);` +
          `self.postMessage = (data) => parent.postMessage(data, "*");` +
          `self.importScripts = (...urls) => Promise.all(urls.map((url) => new Promise((done, failed) => {` +
          `const script = document.createElement("script"); script.src = new URL(url, ${JSON.stringify(String(url))});` +
          `script.onload = done; script.onerror = failed; document.body.appendChild(script); })));</` +
          `script><script src="${url}"></` +
          `script>`,
      );
      begun.close();
      this.frame = frame;
      this.ready = new Promise((done) => frame.contentWindow.addEventListener("load", done));
      addEventListener("message", (event) => {
        if (event.source !== frame.contentWindow) return;
        const told = new MessageEvent("message", { data: event.data });
        this.dispatchEvent(told);
        this.onmessage?.(told);
      });
    }
    postMessage(data) {
      this.ready.then(() => this.frame.contentWindow.hear(data, "*"));
    }
    terminate() {
      this.frame.remove();
    }
  };
}
