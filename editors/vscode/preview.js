// The panel beside a text: the page of its model, which follows the typing, keeps the last good one while the text is wrong,
// and shows the report of the run.
'use strict';

const vscode = require('vscode');

/** Milliseconds without a change after which the page is made again. */
const QUIET = 300;

const SHELL = `<!DOCTYPE html>
<html><head><meta charset="utf-8"><style>
  html, body { height: 100%; margin: 0; padding: 0; }
  body { display: flex; flex-direction: column; font-family: var(--vscode-font-family); color: var(--vscode-foreground); }
  iframe { flex: 1; border: 0; min-height: 50%; background: white; }
  pre { margin: 0; padding: 6px 12px; max-height: 38%; overflow: auto;
    font: var(--vscode-editor-font-size) var(--vscode-editor-font-family, monospace); }
  #message { white-space: pre-wrap; color: var(--vscode-errorForeground); border-bottom: 1px solid var(--vscode-panel-border, gray); }
  #report { border-top: 1px solid var(--vscode-panel-border, gray); }
  pre:empty { display: none; }
  .old { opacity: 0.5; }
</style></head><body>
<pre id="message"></pre><iframe id="page" title="motion"></iframe><pre id="report"></pre>
<script>
  const part = (name) => document.getElementById(name);
  window.addEventListener('message', ({ data }) => {
    if (data === null || typeof data !== 'object' || !('message' in data)) return;
    part('message').textContent = data.message;
    for (const name of ['page', 'report']) part(name).classList.toggle('old', data.message !== '');
    if (data.message !== '') return;
    part('page').srcdoc = data.page;
    part('report').textContent = data.report;
  });
</script></body></html>`;

/** One panel; `ask` gives what `mechc/preview` answers, undefined where nobody answers. */
class Preview {
  constructor(ask) {
    this.ask = ask;
    this.asking = false;
    this.again = false;
  }

  /** Show the model of a document; of one of its models if it is named. */
  show(document, model) {
    this.uri = document.uri.toString();
    this.model = model;
    if (this.panel === undefined) {
      this.panel = vscode.window.createWebviewPanel('mechc.preview', 'mechc', { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true }, {
        enableScripts: true,
        retainContextWhenHidden: true,
      });
      this.panel.webview.html = SHELL;
      this.panel.onDidDispose(() => {
        this.panel = undefined;
        clearTimeout(this.timer);
      });
    }
    this.panel.title = `${document.uri.path.split('/').pop()} moves`;
    this.panel.reveal(vscode.ViewColumn.Beside, true);
    return this.refresh();
  }

  /** A text has changed. */
  changed(document) {
    if (this.panel === undefined || document.uri.toString() !== this.uri) return;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.refresh(), QUIET);
  }

  /** Ask once more; what changes while the answer is awaited is asked for afterwards. */
  async refresh() {
    if (this.asking) {
      this.again = true;
      return;
    }
    this.asking = true;
    try {
      do {
        this.again = false;
        const found = await this.ask(this.uri, this.model);
        if (found !== undefined && !this.again) this.panel?.webview.postMessage(found);
      } while (this.again);
    } catch (error) {
      this.panel?.webview.postMessage({ page: '', report: '', message: error.message });
    } finally {
      this.asking = false;
    }
  }
}

module.exports = { Preview };
