module.exports = {
  configs: {
    recommended: { rules: { error: 'error', warning: 'warn' } },
    all: { rules: { error: 'error', warning: 'warn', note: 'info' } },
  },
};
