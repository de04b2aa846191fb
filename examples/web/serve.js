// Serves the page: its own files, the project's shader, and of the packages what the page imports.
//
//     npm start                 http://localhost:8080
//     PORT=9000 npm start

import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { dirname, extname, join, normalize } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const HERE = dirname(fileURLToPath(import.meta.url));
const SHADER = join(HERE, '../../src/shader/lookup.glsl');
const SERVED = /^((index|minimal)\.html|style\.css|(src|tables|node_modules\/(three|zstddec|ktx-parse))\/.+)$/;
const TYPES = {
  '.html': 'text/html; charset=utf-8',
  '.css': 'text/css; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.mjs': 'text/javascript; charset=utf-8',
  '.glsl': 'text/plain; charset=utf-8',
};

/** A server of the page. It listens on this machine alone. */
export function serve(port) {
  const server = createServer(async (request, response) => {
    try {
      const url = new URL(request.url, 'http://localhost');
      const path = normalize(decodeURIComponent(url.pathname)).slice(1) || 'index.html';
      if (path === 'lookup.glsl') {
        return send(response, SHADER, await readFile(SHADER));
      }
      if (SERVED.test(path) && !path.includes('..')) {
        return send(response, path, await readFile(join(HERE, path)));
      }
    } catch {
      // As if it were not there.
    }
    response.writeHead(404).end();
  });
  return new Promise((resolve, reject) => {
    server.on('error', reject);
    server.listen(port, '127.0.0.1', () => resolve(server));
  });
}

function send(response, path, content) {
  const type = TYPES[extname(path)] ?? 'application/octet-stream';
  response.writeHead(200, { 'content-type': type, 'cache-control': 'no-cache' }).end(content);
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) {
  const server = await serve(Number(process.env.PORT ?? 8080));
  console.log(`http://localhost:${server.address().port}`);
}
