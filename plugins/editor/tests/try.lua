-- What tests/test_neovim.py lets Neovim do; the answers are in said.json.
vim.cmd("filetype on")
dofile("settings.lua")
vim.cmd("edit design.yaml")
local said = {}
local function wait(what) said.waited = vim.wait(60000, what, 50) end
local function ask(method, line, column, more)
  vim.api.nvim_win_set_cursor(0, { line, column })
  local params = vim.tbl_extend("force", vim.lsp.util.make_position_params(), more or {})
  for _, answer in pairs(vim.lsp.buf_request_sync(0, method, params, 60000) or {}) do return answer.result end
end
wait(function() return #vim.diagnostic.get(0) > 0 end)
said.findings = vim.tbl_map(function(each) return { each.code, each.lnum, each.col, each.message } end, vim.diagnostic.get(0))
said.hover = ask("textDocument/hover", 5, 30).contents.value
said.completed = vim.tbl_map(function(each) return each.label end, ask("textDocument/completion", 5, 40).items)
local range = vim.lsp.util.make_given_range_params({ 5, 40 }, { 5, 41 })
local actions = ask("textDocument/codeAction", 5, 40, { range = range.range, context = { diagnostics = {} } })
said.actions = vim.tbl_map(function(each) return each.title end, actions)
vim.lsp.util.apply_workspace_edit(actions[1].edit, "utf-16")
wait(function() return #vim.diagnostic.get(0) == 0 end)
said.text = vim.api.nvim_buf_get_lines(0, 0, -1, false)
vim.fn.writefile({ vim.fn.json_encode(said) }, "said.json")
vim.cmd("qa!")
