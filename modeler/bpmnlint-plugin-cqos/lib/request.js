// Posts the JSON on standard input to the address in the first argument, and prints the answer.
const [, , url] = process.argv;
const SECONDS = 60;

async function main() {
  let body = '';
  for await (const part of process.stdin.setEncoding('utf8')) body += part;
  const headers = { 'content-type': 'application/json', 'connect-protocol-version': '1' };
  if (process.env.CQOS_TOKEN) headers.authorization = `Bearer ${process.env.CQOS_TOKEN}`;
  let answer;
  try {
    answer = await fetch(url, { method: 'POST', headers, body, signal: AbortSignal.timeout(SECONDS * 1000) });
  } catch (error) {
    throw new Error(
      `no answer (${error.cause?.code ?? error.message}). Start \`cqos serve --web 127.0.0.1:8080\`, or set CQOS_SERVICE`,
    );
  }
  const text = await answer.text();
  if (!answer.ok) throw new Error(`refused with ${answer.status}: ${text.slice(0, 1000)}`);
  process.stdout.write(text);
}

main().catch((error) => {
  console.error(error.message);
  process.exitCode = 1;
});
