// What an editor shows of mechc: the language server `mechc lsp`, commands that run the file in a terminal, a panel that follows
// the typing.
'use strict';

const path = require('node:path');
const vscode = require('vscode');
const { LanguageClient } = require('vscode-languageclient/node');
const { Preview } = require('./preview');

/** Arguments of mechc for each command, from the file, with its model if one was named, and what the settings add to a run. */
const COMMANDS = {
  'mechc.run': (model, added) => ['run', ...model, ...added],
  'mechc.plot': (model, added) => ['run', ...model, ...added, '--plot'],
  'mechc.view': (model) => ['view', ...model],
  'mechc.explain': (model) => ['explain', ...model],
  'mechc.equations': (model) => ['equations', ...model],
  'mechc.modes': (model) => ['study', 'modes', ...model],
};

let client;

/** The panel beside a text. */
const preview = new Preview((uri, model) => client?.sendRequest('mechc/preview', { uri, model }));

function settings(resource) {
  return vscode.workspace.getConfiguration('mechc', resource);
}

async function start() {
  const command = settings().get('path');
  const started = new LanguageClient(
    'mechc',
    'mechc',
    { command, args: ['lsp'] },
    { documentSelector: [{ language: 'mech' }], synchronize: { fileEvents: vscode.workspace.createFileSystemWatcher('**/*.mech') } },
  );
  client = started;
  try {
    await started.start();
  } catch (error) {
    client = undefined;
    vscode.window.showErrorMessage(
      `'${command} lsp' does not start: ${error?.message ?? error}. Install it by pip install "mechc[editor]", ` +
        'or say in the setting mechc.path where it is.',
    );
  }
}

async function stop() {
  const running = client;
  client = undefined;
  if (running !== undefined) await running.stop();
}

/** Save the file before the cursor, and run mechc on it in a terminal; without a shell, so that nothing needs quotes. */
async function execute(name, model) {
  const document = vscode.window.activeTextEditor?.document;
  if (document?.languageId !== 'mech') {
    vscode.window.showErrorMessage('This command needs a .mech file in the editor.');
    return;
  }
  if (!(await document.save()) || document.uri.scheme !== 'file') {
    vscode.window.showErrorMessage('The file must be saved on this machine before mechc can run it.');
    return;
  }
  const file = document.uri.fsPath;
  const chosen = model === undefined ? [file] : [file, '--model', model];
  const found = settings(document.uri);
  const task = new vscode.Task(
    { type: 'process' },
    vscode.workspace.getWorkspaceFolder(document.uri) ?? vscode.TaskScope.Workspace,
    `${name} ${path.basename(file)}`,
    'mechc',
    new vscode.ProcessExecution(found.get('path'), COMMANDS[name](chosen, found.get('runArguments')), {
      cwd: path.dirname(file),
    }),
  );
  task.presentationOptions = { reveal: vscode.TaskRevealKind.Always, clear: true };
  await vscode.tasks.executeTask(task);
}

async function activate(context) {
  for (const name of Object.keys(COMMANDS)) {
    context.subscriptions.push(vscode.commands.registerCommand(name, (_, model) => execute(name, typeof model === 'string' ? model : undefined)));
  }
  const shown = (_, model) => {
    const document = vscode.window.activeTextEditor?.document;
    if (document?.languageId === 'mech') return preview.show(document, typeof model === 'string' ? model : undefined);
    return vscode.window.showErrorMessage('This command needs a .mech file in the editor.');
  };
  context.subscriptions.push(vscode.commands.registerCommand('mechc.preview', shown));
  context.subscriptions.push(vscode.workspace.onDidChangeTextDocument((change) => preview.changed(change.document)));
  const restart = async () => {
    await stop();
    await start();
  };
  context.subscriptions.push(vscode.commands.registerCommand('mechc.restart', restart));
  context.subscriptions.push(
    vscode.workspace.onDidChangeConfiguration((change) => (change.affectsConfiguration('mechc.path') ? restart() : undefined)),
  );
  await start();
}

module.exports = { activate, deactivate: stop };
