// @ts-check
"use strict";
const path = require("node:path");
const { window, workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

/** @type {LanguageClient | undefined} */
let client;

/** The languages of files that C-QoS reads; the server passes over those that are of no format it knows. */
const LANGUAGES = ["yaml", "json", "jsonc", "toml", "xml", "bpmn", "properties", "ini", "plaintext"];

/** Start the server.
 * @returns {Promise<void>}
 */
async function start() {
  const folder = workspace.workspaceFolders?.[0]?.uri.fsPath;
  /** @type {string[]} */
  const given = workspace.getConfiguration("cqos").get("command") ?? ["cqos", "lsp"];
  const [command = "cqos", ...args] = given;
  const relative = folder !== undefined && /[\\/]/.test(command) && !path.isAbsolute(command);
  client = new LanguageClient(
    "cqos",
    "C-QoS",
    { command: relative ? path.join(folder, command) : command, args, options: { cwd: folder } },
    {
      documentSelector: LANGUAGES.map((language) => ({ scheme: "file", language })),
      initializationOptions: workspace.getConfiguration("cqos"),
      synchronize: {
        configurationSection: "cqos",
        fileEvents: workspace.createFileSystemWatcher("**/*.{yaml,yml,json,json5,toml,xml,bpmn,conf,rviz}"),
      },
    },
  );
  try {
    await client.start();
  } catch (error) {
    client = undefined;
    const reason = error instanceof Error ? error.message : String(error);
    void window.showErrorMessage(`C-QoS: \`${given.join(" ")}\` does not start: ${reason}. pip install cqos-lsp`);
  }
}

/** @param {import("vscode").ExtensionContext} context */
function activate(context) {
  context.subscriptions.push(
    workspace.onDidChangeConfiguration(async (event) => {
      if (event.affectsConfiguration("cqos.command")) {
        await deactivate();
        await start();
      }
    }),
  );
  return start();
}

/** @returns {Promise<void>} */
async function deactivate() {
  await client?.stop();
  client = undefined;
}

module.exports = { activate, deactivate };
