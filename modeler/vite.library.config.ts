import { defineConfig } from 'vite';

// The package for pages of others: their bundler brings bpmn-js and the client's runtime.
export default defineConfig({
  publicDir: false,
  build: {
    lib: { entry: 'src/embed.ts', formats: ['es'], fileName: 'cqos-modeler', cssFileName: 'cqos-modeler' },
    outDir: 'dist',
    emptyOutDir: true,
    target: 'es2022',
    rolldownOptions: { external: [/^bpmn-js\//, /^diagram-js\//, /^@bufbuild\//, /^@connectrpc\//] },
  },
});
