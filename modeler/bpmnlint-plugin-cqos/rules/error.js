module.exports = require('../lib/rule')('error');
