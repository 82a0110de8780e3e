module.exports = require('../lib/rule')('note');
